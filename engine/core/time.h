#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace engine {

/// Integer nanoseconds. A Julian date in one double is 40 us wide: 7 pixels of a fast pass.
using Duration = std::chrono::duration<std::int64_t, std::nano>;

/// The two time lines. They are types, so that one cannot be taken for the other.
struct SimTimeline {};
struct TaiTimeline {};

/// Simulated time since the scenario's epoch, in SI seconds.
using SimTime = std::chrono::time_point<SimTimeline, Duration>;
/// TAI since 2000-01-01T12:00:00 TAI. UTC exists only at the edges (orbit/utc.h).
using Epoch = std::chrono::time_point<TaiTimeline, Duration>;

[[nodiscard]] constexpr double seconds(Duration d) noexcept {
  return static_cast<double>(d.count()) * 1e-9;
}

/// To the nearest nanosecond. Pre: |s| < 9.2e9.
[[nodiscard]] inline Duration from_seconds(double s) noexcept {
  return Duration(static_cast<std::int64_t>(std::llround(s * 1e9)));
}

[[nodiscard]] inline SimTime sim_time(double s) noexcept { return SimTime(from_seconds(s)); }
[[nodiscard]] constexpr double seconds(SimTime t) noexcept { return seconds(t.time_since_epoch()); }

}  // namespace engine
