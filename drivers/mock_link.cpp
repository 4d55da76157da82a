#include "drivers/mock_link.h"

#include <algorithm>

#include "hil/space_packet.h"

namespace drivers {

using engine::Done;
using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::Fault;
using engine::Status;

MockLink::MockLink(int width_px, int height_px) {
  for (Slot& slot : slots_) slot.bytes.resize(largest_frame_bytes(width_px, height_px));
}

Status MockLink::send(const hil::Frame& frame, Duration timeout) noexcept {
  if (!empty_.try_acquire_for(timeout)) return Error{Fault::kBusy, 0, "mock: every slot is held"};
  Slot& slot = slots_[next_to_fill_];
  const Expected<std::size_t> used = encode_frame(frame, slot.bytes);
  if (!used.ok()) {
    empty_.release();
    return used.error();
  }
  slot.used = used.value();
  next_to_fill_ = (next_to_fill_ + 1) % kSlots;
  full_.release();
  return Done{};
}

Expected<hil::Command> MockLink::receive(Duration timeout) noexcept {
  if (!packet_count_.try_acquire_for(timeout)) return Error{Fault::kTimeout, 0, "mock: receive"};
  Packet packet;
  if (!packets_.pop(packet)) return Error{Fault::kTimeout, 0, "mock: receive"};
  return hil::decode_command(std::span(packet.bytes).first(packet.used));
}

Expected<std::span<const std::byte>> MockLink::next_frame(Duration timeout) noexcept {
  if (!full_.try_acquire_for(timeout)) return Error{Fault::kTimeout, 0, "mock: next frame"};
  const Slot& slot = slots_[next_to_read_];
  return std::span<const std::byte>(slot.bytes).first(slot.used);
}

void MockLink::release_frame() noexcept {
  next_to_read_ = (next_to_read_ + 1) % kSlots;
  empty_.release();
}

Status MockLink::reply(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() > kLargestPacket) return Error{Fault::kRejected, 0, "mock: reply too long"};
  Packet packet;
  std::copy(bytes.begin(), bytes.end(), packet.bytes.begin());
  packet.used = bytes.size();
  if (!packets_.push(packet)) return Error{Fault::kBusy, 0, "mock: reply"};
  packet_count_.release();
  return Done{};
}

}  // namespace drivers
