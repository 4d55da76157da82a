#pragma once

#include <array>
#include <semaphore>
#include <span>
#include <vector>

#include "drivers/frame_packet.h"
#include "drivers/packet_queue.h"
#include "hil/camera_link.h"

namespace drivers {

/// A cable without hardware: frames cross it as the bytes of frame_packet.h, commands as those
/// of hil/space_packet.h, and nothing else does. The device's side is the lower half of the
/// interface.
///
/// A device that reads slowly holds its slots; the camera's side then says kBusy after its timeout
/// and goes on. Thread: sender for send(), receiver for receive(), one device thread for the rest.
class MockLink final : public hil::FrameSink, public hil::CommandSource {
 public:
  MockLink(int width_px, int height_px);

  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept override {
    return packets_.receive(timeout);
  }

  /// The device's side. The bytes are the device's until it calls release_frame().
  [[nodiscard]] engine::Expected<std::span<const std::byte>> next_frame(
      engine::Duration timeout) noexcept;
  void release_frame() noexcept;
  /// kBusy when the camera has not taken the last 64 packets; kRejected for more than 256 bytes.
  engine::Status reply(std::span<const std::byte> bytes) noexcept { return packets_.push(bytes); }

 private:
  static constexpr std::size_t kSlots = 3;
  struct Slot {
    std::vector<std::byte> bytes;
    std::size_t used = 0;
  };

  std::array<Slot, kSlots> slots_;
  std::size_t next_to_fill_ = 0;  // the sender's own
  std::size_t next_to_read_ = 0;  // the device's own
  std::counting_semaphore<> empty_{kSlots};
  std::counting_semaphore<> full_{0};
  PacketQueue packets_;  // device -> receiver
};

}  // namespace drivers
