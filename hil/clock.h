#pragma once

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

  [[nodiscard]] engine::SimTime now() const noexcept override { return now_; }
  engine::Duration sleep_until(engine::SimTime t) noexcept override {
    if (t > now_) {
      now_ = t;
      return engine::Duration{};
    }
    return now_ - t;
  }
  /// Lets time pass without anybody having asked: a stage that takes long.
  void pass(engine::Duration d) noexcept { now_ += d; }

 private:
  engine::SimTime now_;
};

}  // namespace hil
