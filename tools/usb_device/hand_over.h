#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/shm_link.h"
#include "drivers/usb_device/frame_intake.h"
#include "hil/space_packet.h"

namespace usb_device {

/// The camera that a device in software stands for, and who reads it.
struct HandOverSpec {
  std::string shm = "starloop-usb";  ///< name of the shared memory
  int width_px = 1024;
  int height_px = 1024;  ///< without a telemetry row
  int frames = 3;        ///< that the device has room for, in [1, 15]
};

/// What such a device says of itself to a host.
[[nodiscard]] drivers::UsbLimits limits_of(const HandOverSpec& spec);

/// Counts that add up: frames == taken + not_taken + other_sizes.
struct HandOverCounts {
  std::uint64_t frames = 0;
  std::uint64_t taken = 0;
  std::uint64_t not_taken = 0;    ///< nobody read, or the reader held every slot
  std::uint64_t other_sizes = 0;  ///< whole, and not of this camera
};

/// The on-board end of a USB stream, whatever carries it: whole frames become frames of the client
/// library, with what the camera said of itself behind the pixels, and the reader's commands come
/// back as packets.
/// Thread: one for frames; commands come on a thread of their own. Allocates when made.
class HandOver {
 public:
  /// Throws std::runtime_error as ShmLink does.
  explicit HandOver(const HandOverSpec& spec);

  /// Empties the intake. Never waits: a reader that is late loses frames, not the stream.
  void take_frames(drivers::FrameIntake& intake) noexcept;
  /// Thread: that of take_frames().
  [[nodiscard]] const HandOverCounts& counts() const noexcept { return counts_; }

  using TakeCommand = std::function<void(const hil::CommandPacket&)>;
  /// A thread that gives each command of the reader to `take`, until it is asked to stop. It must
  /// end before this object does.
  [[nodiscard]] std::jthread return_commands(TakeCommand take);

 private:
  void hand_over(const drivers::FrameIntake::Frame& f) noexcept;
  /// Returns the telemetry row.
  std::span<const std::uint16_t> unpack(const drivers::FrameIntake::Frame& f) noexcept;

  drivers::ShmLink shm_;
  engine::DnImage picture_;
  // Pixels of the image behind the last whole group of eight, and the telemetry row.
  std::vector<std::uint16_t> rest_;
  HandOverCounts counts_;
};

}  // namespace usb_device
