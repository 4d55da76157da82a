#include "hil/frame_writer.h"

#include <algorithm>
#include <exception>

namespace hil {

FrameWriter::FrameWriter(FrameStore& store, int width_px, int height_px, WhenBusy when_busy)
    : store_(store), when_busy_(when_busy) {
  for (std::size_t i = 0; i < kSlots; ++i) {
    slots_[i].pixels.resize(width_px, height_px);
    slots_[i].row.resize(static_cast<std::size_t>(width_px));
    ENSURE(free_.push(i));
  }
  free_count_.release(kSlots);
  writer_ = std::jthread([this] { write_frames(); });
}

FrameWriter::~FrameWriter() { finish(); }

void FrameWriter::finish() noexcept {
  if (!writer_.joinable()) return;
  done_ = true;
  ready_count_.release();
  writer_.join();
  try {
    store_.finish();
  } catch (const std::exception& e) {
    remember(e.what());
  }
}

engine::Status FrameWriter::take(const Frame& frame, engine::Duration timeout) noexcept {
  const bool free = when_busy_ == WhenBusy::kWait ? free_count_.try_acquire_for(timeout)
                                                  : free_count_.try_acquire();
  std::size_t i = 0;
  if (!free || !free_.pop(i)) {
    ++left_out_;
    return engine::Error{engine::Fault::kBusy, 0, "recorder"};
  }
  Slot& slot = slots_[i];
  const auto pixels = frame.pixels->pixels();
  ENSURE(pixels.size() == slot.pixels.pixels().size());
  std::copy(pixels.begin(), pixels.end(), slot.pixels.pixels().begin());
  slot.frame = frame;
  slot.frame.pixels = &slot.pixels;
  const std::span<const std::uint16_t> row = frame.telemetry_row;
  ENSURE(row.size() <= slot.row.size());
  std::copy(row.begin(), row.end(), slot.row.begin());
  slot.frame.telemetry_row = std::span(slot.row).first(row.size());
  slot.frame.truth_mask = nullptr;
  ENSURE(ready_.push(i));
  ready_count_.release();
  return engine::Done{};
}

void FrameWriter::write_frames() noexcept {
  for (;;) {
    ready_count_.acquire();
    std::size_t i = 0;
    if (!ready_.pop(i)) {
      if (done_) return;
      continue;
    }
    try {
      store_.put(slots_[i].frame);
      ++written_;
    } catch (const std::exception& e) {
      ++failed_;
      remember(e.what());
    }
    ENSURE(free_.push(i));
    free_count_.release();
  }
}

void FrameWriter::remember(const char* words) noexcept {
  if (failure_.empty()) failure_ = words;
}

}  // namespace hil
