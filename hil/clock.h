#pragma once

#include <atomic>

#include "engine/core/time.h"

namespace hil {

/// Where "now" comes from. SteadyClock paces the rig; ManualClock makes tests, and runs that wait
/// for the software under test, instant and exact.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual engine::SimTime now() const noexcept = 0;
  /// Blocks until `t`; returns how late it woke up, never negative.
  virtual engine::Duration sleep_until(engine::SimTime t) noexcept = 0;
};

/// Stands still until somebody sleeps; then it is exactly as late as it was told to be.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(engine::SimTime start) : now_(start) {}

  /// Thread: any; the rest is the loop's.
  [[nodiscard]] engine::SimTime now() const noexcept override {
    return now_.load(std::memory_order_relaxed);
  }
  engine::Duration sleep_until(engine::SimTime t) noexcept override {
    if (t <= now()) return now() - t;
    now_.store(t, std::memory_order_relaxed);
    return engine::Duration{};
  }
  /// Lets time pass without anybody having asked: a stage that takes long.
  void pass(engine::Duration d) noexcept { now_.store(now() + d, std::memory_order_relaxed); }

 private:
  std::atomic<engine::SimTime> now_;
};

}  // namespace hil
