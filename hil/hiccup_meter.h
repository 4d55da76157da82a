#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "hil/spsc_ring.h"
#include "hil/steady_clock.h"

namespace hil {

/// A stretch of time in which the machine did not run a thread that only wanted to sleep; on the
/// stopwatch's line.
struct Hiccup {
  engine::Duration from{};
  engine::Duration to{};
};

/// How late a sleeper woke, counted in eighths of an octave from 1 us up: error under 9 %.
class WakeHistogram {
 public:
  void add(engine::Duration late) noexcept;
  void add(const WakeHistogram& other) noexcept;
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] engine::Duration worst() const noexcept { return worst_; }
  /// The lateness that `share` of the wakes stay under, at its bin's upper edge.
  [[nodiscard]] engine::Duration quantile(double share) const noexcept;

 private:
  static constexpr std::size_t kBinsPerOctave = 8;
  static constexpr std::size_t kBins = 32 * kBinsPerOctave;  // to 4000 s
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  engine::Duration worst_{};
};

/// The hiccups of the last seconds, and how much of a stretch of time they cover.
/// Thread: loop.
class HiccupHistory {
 public:
  void add(const Hiccup& h) noexcept {
    last_[next_] = h;
    next_ = (next_ + 1) % last_.size();
  }
  /// Hiccups do not overlap: each is one wake of one thread.
  [[nodiscard]] engine::Duration within(engine::Duration from, engine::Duration to) const noexcept;

 private:
  std::array<Hiccup, 256> last_{};
  std::size_t next_ = 0;
};

/// A thread that sleeps for a millisecond, over and over, and does nothing else. What delays it
/// delays the loop as well, and is the machine's doing. Give it the highest priority there is:
/// without one it also feels our own workers.
class HiccupMeter {
 public:
  /// Wakes later than this are hiccups worth telling the loop of.
  static constexpr engine::Duration kWorthTelling{200'000};

  /// Starts the thread; `priority` as for hil::raise_priority(), 0 for none.
  explicit HiccupMeter(int priority);
  ~HiccupMeter() = default;
  HiccupMeter(const HiccupMeter&) = delete;
  HiccupMeter& operator=(const HiccupMeter&) = delete;

  /// Thread: loop.
  [[nodiscard]] bool next(Hiccup& h) noexcept { return told_.pop(h); }
  /// When the thread wants to wake, or wanted to and has not yet told. Thread: loop.
  [[nodiscard]] engine::Duration due() const noexcept {
    return due_.load(std::memory_order_acquire);
  }
  /// Ends the thread. Thread: the one that made it.
  const WakeHistogram& finish();

 private:
  void measure(const std::stop_token& stop, int priority) noexcept;

  SpscRing<Hiccup, 1024> told_;        // meter -> loop
  std::atomic<engine::Duration> due_;  // meter -> loop
  WakeHistogram wakes_;                // the meter's own until it is joined
  std::jthread thread_;                // the last member: it uses the others
};

}  // namespace hil
