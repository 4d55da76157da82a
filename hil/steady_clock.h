#pragma once

#include "hil/clock.h"

namespace hil {

/// CLOCK_MONOTONIC with absolute sleeps: no drift, and steps of the wall clock do not show.
class SteadyClock final : public Clock {
 public:
  /// `start` is the simulated time at this moment.
  explicit SteadyClock(engine::SimTime start) noexcept;

  /// As if made now. Pre: no other thread reads it yet.
  void restart(engine::SimTime start) noexcept;

  [[nodiscard]] engine::SimTime now() const noexcept override;
  engine::Duration sleep_until(engine::SimTime t) noexcept override;

  /// For measuring how long something took.
  [[nodiscard]] static engine::Duration stopwatch() noexcept;
  static void sleep_until_stopwatch(engine::Duration t) noexcept;

 private:
  engine::SimTime start_;
  engine::Duration started_at_;
};

}  // namespace hil
