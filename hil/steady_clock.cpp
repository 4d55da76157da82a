#include "hil/steady_clock.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace hil {

using engine::Duration;
using engine::SimTime;

SteadyClock::SteadyClock(SimTime start) noexcept : start_(start), started_at_(stopwatch()) {}

void SteadyClock::restart(SimTime start) noexcept {
  start_ = start;
  started_at_ = stopwatch();
}

Duration SteadyClock::stopwatch() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + Duration(t.tv_nsec);
}

SimTime SteadyClock::now() const noexcept { return start_ + (stopwatch() - started_at_); }

Duration SteadyClock::sleep_until(SimTime t) noexcept {
  sleep_until_stopwatch(started_at_ + (t - start_));
  return std::max(Duration{}, now() - t);
}

void SteadyClock::sleep_until_stopwatch(Duration wake) noexcept {
  const auto whole = std::chrono::floor<std::chrono::seconds>(wake);
  const timespec deadline{whole.count(), (wake - whole).count()};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace hil
