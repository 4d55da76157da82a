#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/usb_packet.h"

namespace drivers {

/// What a device does with the bytes of the USB stream, whatever carries them: the state machine of
/// usb_protocol.md.
///
/// A frame ends where its last packet is short, and only there: bytes that are no whole frame cost
/// what comes up to that end, never the frame after it. Credits are frames that the host may begin;
/// a slot that is free again is one more.
/// Thread: one. Allocates when made.
class FrameIntake {
 public:
  explicit FrameIntake(const UsbLimits& limits);

  /// UsbRequest::kReset: forgets everything, and counts from zero.
  void reset(std::uint32_t session) noexcept;
  /// Bytes of the bulk OUT endpoint in their order. `ends`: the last packet of these was short, or
  /// of length zero.
  void take(std::span<const std::byte> bytes, bool ends) noexcept;

  struct Frame {
    UsbFrameHeader header;
    std::span<const std::byte> payload;
  };
  /// The oldest whole frame; it stays until pop().
  [[nodiscard]] std::optional<Frame> front() const noexcept;
  /// Pre: there is one.
  void pop() noexcept;

  /// A packet of hil/space_packet.h, to go out as a message. False: sixteen wait already, or it is
  /// too long.
  bool command(std::span<const std::byte> packet) noexcept;
  /// What goes into the next bulk IN transfer: a status when there is news, and commands. Returns
  /// how many bytes of `out` it used; 0: there is nothing to say. Pre: room for kLargestUsbMessage.
  [[nodiscard]] std::size_t next_message(std::span<std::byte> out) noexcept;
  /// A status at once: the answer to UsbRequest::kStatus. Pre: as above.
  [[nodiscard]] std::size_t status_message(std::span<std::byte> out) const noexcept;
  [[nodiscard]] const UsbStatus& status() const noexcept { return status_; }
  [[nodiscard]] const UsbLimits& limits() const noexcept { return limits_; }

 private:
  static constexpr std::size_t kCommands = 16;
  struct Slot {
    std::vector<std::byte> bytes;
    UsbFrameHeader header;
  };
  struct Packet {
    std::array<std::byte, kLargestUsbMessage - kUsbMessageHeaderBytes> bytes{};
    std::size_t used = 0;
  };
  enum class State : std::uint8_t { kBetween, kInFrame, kSkipping };

  void begin_payload() noexcept;
  void end_transfer() noexcept;
  [[nodiscard]] Slot& filling() noexcept { return slots_[(first_ + whole_) % slots_.size()]; }

  UsbLimits limits_;
  std::vector<Slot> slots_;
  std::size_t first_ = 0;  // the oldest whole frame
  std::size_t whole_ = 0;
  State state_ = State::kBetween;
  bool header_is_good_ = false;
  std::size_t held_ = 0;  // bytes of the frame in hand
  std::array<Packet, kCommands> commands_;
  std::size_t first_command_ = 0;
  std::size_t waiting_commands_ = 0;
  std::uint32_t session_ = 0;
  std::uint16_t count_ = 0;
  UsbStatus status_;
  UsbStatus told_;
  bool never_told_ = true;
  bool told_last_ = false;  // the last message was a status
};

}  // namespace drivers
