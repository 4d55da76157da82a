#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "engine/core/time.h"

namespace engine {

/// The scales that dates are written in. All but UTC run with TAI, at a fixed distance.
enum class TimeScale : std::uint8_t {
  kUtc,  ///< behind TAI by the leap seconds
  kTai,
  kTt,   ///< TAI + 32.184 s
  kGps,  ///< TAI - 19 s
};

/// The years that a scenario may be in. Before the first UTC ran at another rate than TAI; after
/// the last an Epoch would soon be full.
inline constexpr int kFirstYear = 1972;
inline constexpr int kLastYear = 2280;

/// A date as CCSDS 301.0-B-4 writes it (ASCII code A or B): "2022-01-01T00:00:00" or
/// "2022-001T00:00:00", with up to nine decimals, and an optional Z for UTC; UTC's second 60 where
/// there was one. Exact to the nanosecond. Nothing when the text is anything else, or outside
/// [kFirstYear, kLastYear].
[[nodiscard]] std::optional<Epoch> epoch_from_text(std::string_view text, TimeScale scale) noexcept;
[[nodiscard]] inline std::optional<Epoch> epoch_from_utc(std::string_view text) noexcept {
  return epoch_from_text(text, TimeScale::kUtc);
}

/// To the nearest of so many decimals: "2022-01-04T14:02:41.630". In a leap second "23:59:60.5".
/// Pre: 0 <= decimals <= 9.
[[nodiscard]] std::string utc_text(Epoch t, int decimals = 3);

/// Whether UTC is a guess then: ERFA's table of leap seconds is too old to know that year, and goes
/// on with the last it has. Nothing but dates is wrong by that, and the Earth's rotation.
[[nodiscard]] bool utc_is_a_guess(Epoch t) noexcept;

/// A Julian date in two parts, as ERFA takes it.
struct TwoPartDate {
  double day1 = 0;
  double day2 = 0;
};
[[nodiscard]] TwoPartDate utc_date(Epoch t) noexcept;
[[nodiscard]] TwoPartDate terrestrial_time(Epoch t) noexcept;

}  // namespace engine
