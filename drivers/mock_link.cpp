#include "drivers/mock_link.h"

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

Expected<std::span<const std::byte>> MockLink::next_frame(Duration timeout) noexcept {
  if (!full_.try_acquire_for(timeout)) return Error{Fault::kTimeout, 0, "mock: next frame"};
  const Slot& slot = slots_[next_to_read_];
  return std::span<const std::byte>(slot.bytes).first(slot.used);
}

void MockLink::release_frame() noexcept {
  next_to_read_ = (next_to_read_ + 1) % kSlots;
  empty_.release();
}

}  // namespace drivers
