#include "hil/steady_clock.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace hil {

using engine::Duration;
using engine::SimTime;

SteadyClock::SteadyClock(SimTime start) noexcept : start_(start), started_at_(stopwatch()) {}

Duration SteadyClock::stopwatch() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + Duration(t.tv_nsec);
}

SimTime SteadyClock::now() const noexcept { return start_ + (stopwatch() - started_at_); }

Duration SteadyClock::sleep_until(SimTime t) noexcept {
  const Duration wake = started_at_ + (t - start_);
  const auto whole = std::chrono::floor<std::chrono::seconds>(wake);
  const timespec deadline{whole.count(), (wake - whole).count()};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
  return std::max(Duration{}, now() - t);
}

}  // namespace hil
