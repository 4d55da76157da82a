#pragma once

#include <optional>
#include <string>

#include "engine/core/time.h"

namespace engine {

/// "2022-01-01T00:00:00", with up to nine decimals and an optional Z; second 60 where there was
/// one. Nothing when the text is not a date, or when ERFA has no UTC for it (before 1972).
[[nodiscard]] std::optional<Epoch> epoch_from_utc(const std::string& text) noexcept;

/// To the nearest millisecond: "2022-01-04T14:02:41.630".
[[nodiscard]] std::string utc_text(Epoch t);

/// A Julian date in two parts, as ERFA takes it.
struct TwoPartDate {
  double day1 = 0;
  double day2 = 0;
};
[[nodiscard]] TwoPartDate utc_date(Epoch t) noexcept;
[[nodiscard]] TwoPartDate terrestrial_time(Epoch t) noexcept;

}  // namespace engine
