#pragma once

#include <array>
#include <atomic>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "hil/frame_loop.h"
#include "hil/frame_store.h"
#include "hil/spsc_ring.h"

namespace hil {

/// Copies frames out of the sender's hands and puts them into a store on a thread of its own, so
/// that a disk never holds up a link. When it is slow, a frame is left out and counted; a rehearsal
/// waits instead. Four buffers, taken once.
class FrameWriter {
 public:
  /// The store outlives it.
  FrameWriter(FrameStore& store, int width_px, int height_px, WhenBusy when_busy);
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  /// kBusy: left out. Thread: sender. Neither throws nor allocates, nor waits beyond `timeout`.
  engine::Status take(const Frame& frame, engine::Duration timeout) noexcept;
  /// Writes what is still waiting and finishes the store. After that no frame is taken any more.
  void finish() noexcept;

  // Counts that add up: taken for == written + left out + failed. Read them after finish().
  [[nodiscard]] std::uint64_t written() const noexcept { return written_; }
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }
  [[nodiscard]] std::uint64_t failed() const noexcept { return failed_; }
  /// What the store said the first time that it failed; it is asked again for each frame.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }

 private:
  static constexpr std::size_t kSlots = 4;
  struct Slot {
    Frame frame;
    engine::DnImage pixels;
    std::vector<std::uint16_t> row;
  };
  void write_frames() noexcept;
  void remember(const char* words) noexcept;

  FrameStore& store_;
  WhenBusy when_busy_;
  std::array<Slot, kSlots> slots_;
  std::atomic<bool> done_{false};
  SpscRing<std::size_t, kSlots> ready_;  // sender -> writer
  SpscRing<std::size_t, kSlots> free_;   // writer -> sender
  std::counting_semaphore<> ready_count_{0};
  std::counting_semaphore<> free_count_{0};
  std::uint64_t left_out_ = 0;  // the sender's own
  std::uint64_t written_ = 0;   // these three the writer's own until it is joined
  std::uint64_t failed_ = 0;
  std::string failure_;
  std::jthread writer_;
};

}  // namespace hil
