#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/frame_packet.h"
#include "drivers/usb_device/usb_function.h"
#include "drivers/usb_device/uvc_descriptors.h"

namespace drivers {

/// Pixels as a format has them: the image, and the row below whose low bytes are the telemetry in
/// every format. Pre: `out` has room for uvc_frame_size().
void uvc_pixels(const UvcSpec& spec, UvcFormat format, const FrameView& frame,
                std::span<std::byte> out) noexcept;

/// What goes out of a camera's bulk endpoint: frames in payloads with headers of six bytes (UVC
/// 1.1, 2.4.3; uvc_protocol.md).
///
/// The newest frame wins: one that has been begun is finished, one that waits gives way to the
/// next. The host streams from its first transfer after commit() or stop() on. Frames that are
/// missing in between go out as frames that failed, of two bytes, so that a host counts what the
/// camera counts.
/// Thread: one. Allocates when made, and with commit().
class UvcStream {
 public:
  explicit UvcStream(const UvcSpec& spec);

  /// The format from now on; what was on its way is cut. Nothing goes out before the first one.
  void commit(UvcFormat format);
  /// The host has stopped: what was on its way is cut.
  void stop() noexcept;
  /// As new, but for its counts.
  void reset() noexcept;
  /// Pre: the frame is of the spec's size.
  void offer(const FrameView& frame) noexcept;
  /// Into a transfer of `room` bytes; no value: no frame is there. A payload that ends with a full
  /// transfer before its largest size is followed by an empty one.
  [[nodiscard]] std::optional<UsbAnswer> give(std::size_t room) noexcept;

  struct Counts {
    std::uint64_t offered = 0;
    std::uint64_t idle = 0;
    std::uint64_t sent = 0;
    std::uint64_t overtaken = 0;
    std::uint64_t cut = 0;
    std::uint64_t missed = 0;  ///< gaps in the camera's numbers
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::uint64_t in_hand() const noexcept {
    return (next_.full ? 1U : 0U) + (now_.full ? 1U : 0U);
  }
  /// With the number of frames that the host has counted since it began to stream (from 0): the
  /// sequence of a frame. All ones: it has none yet.
  [[nodiscard]] std::uint64_t first_sequence() const noexcept { return first_sequence_; }

 private:
  static constexpr std::size_t kHeaderBytes = 6;
  static constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
  struct Slot {
    std::vector<std::byte> bytes;
    std::uint64_t sequence = 0;
    std::uint32_t time = 0;  // as payload headers have it
    bool full = false;
  };

  void begin_frame() noexcept;
  void begin_payload() noexcept;
  void end_payload() noexcept;

  UvcSpec spec_;
  bool committed_ = false;
  bool streaming_ = false;
  UvcFormat format_ = UvcFormat::kY16;
  Slot next_;  // the newest that came
  Slot now_;   // on its way
  std::uint64_t last_offered_ = kNone;
  std::uint64_t last_begun_ = kNone;  // since the host streams
  std::uint64_t first_sequence_ = kNone;
  std::uint64_t failed_left_ = 0;  // frames to be told of before the one in hand
  bool toggle_ = false;            // the frame identifier of payload headers
  // The payload in hand: its header, its part of the frame, how much of both is out.
  std::array<std::byte, kHeaderBytes> header_{};
  std::span<const std::byte> data_;
  std::size_t payload_out_ = 0;
  std::size_t frame_out_ = 0;
  bool in_payload_ = false;
  bool owes_empty_ = false;
  Counts counts_;
};

}  // namespace drivers
