#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>

namespace hil {

/// Why a command that arrived whole was not obeyed. The numbers are those of protocol.md.
enum class Refusal : std::uint8_t {
  kDuplicate = 0,  ///< this sequence was obeyed before
  kReordered = 1,  ///< its sequence is below the last one obeyed
  kStale = 2,      ///< older than its time to live
  kFuture = 3,     ///< made later than now: the sender's time line is not ours
  kNotFinite = 4,  ///< a number in it is none
  kReference = 5,  ///< its reference time is centuries away
};
inline constexpr std::size_t kRefusals = 6;

/// One word, for reports and tables.
[[nodiscard]] constexpr const char* name(Refusal cause) noexcept {
  constexpr std::array<const char*, kRefusals> kNames{"duplicate", "reordered",  "stale",
                                                      "future",    "not_finite", "reference"};
  return kNames[static_cast<std::size_t>(cause)];
}

/// How many were refused, by cause.
struct RefusalCounts {
  std::array<std::uint64_t, kRefusals> by_cause{};

  [[nodiscard]] std::uint64_t& operator[](Refusal cause) noexcept {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  [[nodiscard]] std::uint64_t operator[](Refusal cause) const noexcept {
    return by_cause[static_cast<std::size_t>(cause)];
  }
  [[nodiscard]] std::uint64_t total() const noexcept {
    return std::accumulate(by_cause.begin(), by_cause.end(), std::uint64_t{0});
  }
};

}  // namespace hil
