#include "drivers/usb_device/frame_intake.h"

#include <algorithm>
#include <utility>

#include "engine/core/crc32c.h"

namespace drivers {

FrameIntake::FrameIntake(const UsbLimits& limits) : limits_(limits), slots_(limits.frames + 1U) {
  // One more than promised: the frame in hand needs a place before it is known to be one.
  for (Slot& slot : slots_) slot.bytes.resize(kUsbHeaderBytes + limits.payload_bytes);
  reset(0);
}

void FrameIntake::reset(std::uint32_t session) noexcept {
  session_ = session;
  first_ = whole_ = held_ = 0;
  first_command_ = waiting_commands_ = 0;
  state_ = State::kBetween;
  count_ = 0;
  status_ = {};
  status_.credits = limits_.frames;
  never_told_ = true;
  told_last_ = false;
}

void FrameIntake::take(std::span<const std::byte> bytes, bool ends) noexcept {
  while (!bytes.empty()) {
    if (state_ == State::kBetween) {
      state_ = State::kInFrame;
      header_is_good_ = false;
      held_ = 0;
    }
    if (state_ == State::kSkipping) break;
    Slot& slot = filling();
    const std::size_t wanted =
        header_is_good_ ? kUsbHeaderBytes + slot.header.payload_bytes : kUsbHeaderBytes;
    const std::size_t n = std::min(bytes.size(), wanted - held_);
    if (n == 0) {  // whole, and yet it goes on
      ++status_.long_frames;
      ++status_.credits;
      state_ = State::kSkipping;
      break;
    }
    std::copy_n(bytes.begin(), n, slot.bytes.begin() + static_cast<std::ptrdiff_t>(held_));
    held_ += n;
    bytes = bytes.subspan(n);
    if (!header_is_good_ && held_ == kUsbHeaderBytes) begin_payload();
  }
  if (ends) end_transfer();
}

void FrameIntake::begin_payload() noexcept {
  Slot& slot = filling();
  const auto header = decode_usb_header(std::span(slot.bytes).first(kUsbHeaderBytes));
  const bool fits = header.ok() && limits_.takes(header.value().format) &&
                    header.value().width_px <= limits_.width_px &&
                    header.value().height_px + header.value().rows_below <= limits_.height_px &&
                    header.value().payload_bytes <= limits_.payload_bytes;
  if (!fits) {
    ++status_.bad_headers;
    ++status_.credits;
    state_ = State::kSkipping;
    return;
  }
  slot.header = header.value();
  header_is_good_ = true;
}

void FrameIntake::end_transfer() noexcept {
  const State state = std::exchange(state_, State::kBetween);
  if (state != State::kInFrame) return;  // a zero-length packet on its own says nothing
  Slot& slot = filling();
  const bool whole = header_is_good_ && held_ == kUsbHeaderBytes + slot.header.payload_bytes;
  if (!whole) {
    ++status_.short_frames;
    ++status_.credits;
    return;
  }
  const auto payload = std::span<const std::byte>(slot.bytes).subspan(kUsbHeaderBytes);
  if (engine::crc32c(payload.first(slot.header.payload_bytes)) != slot.header.payload_crc32c) {
    ++status_.bad_checksums;
    ++status_.credits;
    return;
  }
  if (whole_ == limits_.frames) {  // the host began one that it had no credit for
    ++status_.not_taken;
    return;
  }
  ++status_.good;
  status_.last_sequence = slot.header.sequence;
  ++whole_;
}

std::optional<FrameIntake::Frame> FrameIntake::front() const noexcept {
  if (whole_ == 0) return std::nullopt;
  const Slot& slot = slots_[first_];
  return Frame{
      slot.header,
      std::span<const std::byte>(slot.bytes).subspan(kUsbHeaderBytes, slot.header.payload_bytes)};
}

void FrameIntake::pop() noexcept {
  ENSURE(whole_ > 0);
  first_ = (first_ + 1) % slots_.size();
  --whole_;
  ++status_.credits;
}

bool FrameIntake::command(std::span<const std::byte> packet) noexcept {
  if (waiting_commands_ == kCommands || packet.size() > commands_.front().bytes.size())
    return false;
  Packet& place = commands_[(first_command_ + waiting_commands_++) % kCommands];
  std::copy(packet.begin(), packet.end(), place.bytes.begin());
  place.used = packet.size();
  return true;
}

std::size_t FrameIntake::next_message(std::span<std::byte> out) noexcept {
  // A status that changes faster than messages go out does not keep commands back.
  const bool commands_turn = waiting_commands_ > 0 && std::exchange(told_last_, false);
  if (never_told_ || (!(status_ == told_) && !commands_turn)) {
    never_told_ = false;
    told_last_ = true;
    told_ = status_;
    const std::size_t bytes = status_message(out);
    ++count_;
    return bytes;
  }
  if (waiting_commands_ == 0) {
    told_last_ = false;
    return 0;
  }
  const Packet& packet = commands_[first_command_];
  UsbMessage m;
  m.kind = UsbMessage::Kind::kCommand;
  m.count = count_++;
  m.session = session_;
  m.command = std::span(packet.bytes).first(packet.used);
  const auto bytes = encode_usb_message(m, out);
  first_command_ = (first_command_ + 1) % kCommands;
  --waiting_commands_;
  return bytes.value();
}

std::size_t FrameIntake::status_message(std::span<std::byte> out) const noexcept {
  UsbMessage m;
  m.count = count_;
  m.session = session_;
  m.status = status_;
  return encode_usb_message(m, out).value();
}

}  // namespace drivers
