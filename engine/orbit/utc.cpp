#include "engine/orbit/utc.h"

#include <erfa.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace engine {
namespace {

using std::chrono::days;
using std::chrono::sys_days;
using std::chrono::year_month_day;

constexpr double kJ2000Date = 2451545.0;
constexpr double kNanosecondsPerDay = 86400e9;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kDay_ns = 86400 * kSecond_ns;
constexpr sys_days kDayOfJ2000 = std::chrono::year{2000} / 1 / 1;  // an Epoch of zero is its noon
constexpr Duration kTtMinusTai{32'184'000'000};
constexpr Duration kTaiMinusGps{19'000'000'000};

/// Reads a date from its beginning on.
class DateText {
 public:
  explicit DateText(std::string_view text) : rest_(text) {}

  /// Just so many digits; nothing else will do, a sign or a blank neither.
  [[nodiscard]] std::optional<int> digits(std::size_t count) noexcept {
    if (rest_.size() < count) return std::nullopt;
    int value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (rest_[i] < '0' || rest_[i] > '9') return std::nullopt;
      value = 10 * value + (rest_[i] - '0');
    }
    rest_.remove_prefix(count);
    return value;
  }
  [[nodiscard]] bool take(char c) noexcept {
    if (rest_.empty() || rest_[0] != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  /// ".25" is 250 000 000; none is 0. Nothing for a point without digits and for more than nine.
  [[nodiscard]] std::optional<std::int64_t> decimals_ns() noexcept {
    if (!take('.')) return 0;
    std::int64_t value = 0;
    int count = 0;
    for (; count < 9; ++count) {
      const auto digit = digits(1);
      if (!digit) break;
      value = 10 * value + *digit;
    }
    if (count == 0) return std::nullopt;
    for (; count < 9; ++count) value *= 10;
    return value;
  }
  [[nodiscard]] std::size_t left() const noexcept { return rest_.size(); }
  [[nodiscard]] char operator[](std::size_t i) const noexcept { return rest_[i]; }

 private:
  std::string_view rest_;
};

std::optional<sys_days> read_day(DateText& text) noexcept {
  const auto year = text.digits(4);
  if (!year || *year < kFirstYear || *year > kLastYear || !text.take('-')) return std::nullopt;
  const std::chrono::year y{*year};
  const bool by_month = text.left() > 2 && text[2] == '-';
  if (!by_month) {
    const auto day = text.digits(3);
    if (!day || *day < 1 || *day > (y.is_leap() ? 366 : 365)) return std::nullopt;
    return sys_days{y / 1 / 1} + days{*day - 1};
  }
  const auto month = text.digits(2);
  if (!month || !text.take('-')) return std::nullopt;
  const auto day = text.digits(2);
  if (!day) return std::nullopt;
  const year_month_day date{y, std::chrono::month{static_cast<unsigned>(*month)},
                            std::chrono::day{static_cast<unsigned>(*day)}};
  if (!date.ok()) return std::nullopt;
  return sys_days{date};
}

/// TAI - UTC as a day begins; 1 of `status` is a guess.
Duration leap_seconds(sys_days day, int* status = nullptr) noexcept {
  const year_month_day date{day};
  double seconds = 0;
  const int found = eraDat(static_cast<int>(date.year()), static_cast<int>(unsigned{date.month()}),
                           static_cast<int>(unsigned{date.day()}), 0.0, &seconds);
  if (status != nullptr) *status = found;
  return from_seconds(seconds);
}

/// When a day of UTC begins.
Epoch midnight_utc(sys_days day) noexcept {
  return Epoch(Duration((day - kDayOfJ2000).count() * kDay_ns - kDay_ns / 2)) + leap_seconds(day);
}

/// The day of UTC that `t` is in.
sys_days day_of(Epoch t) noexcept {
  const std::int64_t since_midnight = t.time_since_epoch().count() / kSecond_ns + 43200;
  // By TAI; UTC is behind it by less than a day.
  const sys_days day = kDayOfJ2000 + std::chrono::floor<days>(std::chrono::seconds(since_midnight));
  return t < midnight_utc(day) ? day - days{1} : day;
}

}  // namespace

std::optional<Epoch> epoch_from_text(std::string_view whole, TimeScale scale) noexcept {
  DateText text(whole);
  const auto day = read_day(text);
  if (!day || !text.take('T')) return std::nullopt;
  const auto hour = text.digits(2);
  if (!hour || *hour > 23 || !text.take(':')) return std::nullopt;
  const auto minute = text.digits(2);
  if (!minute || *minute > 59 || !text.take(':')) return std::nullopt;
  const auto second = text.digits(2);
  const auto decimals = second ? text.decimals_ns() : std::nullopt;
  if (!decimals || *second > 60) return std::nullopt;
  if (scale == TimeScale::kUtc) static_cast<void>(text.take('Z'));
  if (text.left() > 0) return std::nullopt;

  const Duration of_day(((*hour * 60 + *minute) * 60LL + *second) * kSecond_ns + *decimals);
  if (scale == TimeScale::kUtc) {
    const Epoch t = midnight_utc(*day) + of_day;
    if (*second == 60 && (*hour != 23 || *minute != 59 || t >= midnight_utc(*day + days{1})))
      return std::nullopt;
    return t;
  }
  if (*second == 60) return std::nullopt;
  const Epoch t(Duration((*day - kDayOfJ2000).count() * kDay_ns - kDay_ns / 2) + of_day);
  if (scale == TimeScale::kTt) return t - kTtMinusTai;
  return scale == TimeScale::kGps ? t + kTaiMinusGps : t;
}

std::string utc_text(Epoch t, int decimals) {
  std::int64_t unit_ns = kSecond_ns;
  for (int i = 0; i < decimals; ++i) unit_ns /= 10;
  sys_days day = day_of(t);
  const Duration lasts = midnight_utc(day + days{1}) - midnight_utc(day);
  std::int64_t units = ((t - midnight_utc(day)).count() + unit_ns / 2) / unit_ns;
  if (units * unit_ns >= lasts.count()) {
    day += days{1};
    units = 0;
  }
  const std::int64_t of_day_s = units * unit_ns / kSecond_ns;
  // A leap second is the sixty-first of the last minute.
  const int minute_of_day = static_cast<int>(std::min<std::int64_t>(of_day_s / 60, 24 * 60 - 1));
  const int second = static_cast<int>(of_day_s - 60LL * minute_of_day);
  const year_month_day date{day};
  char text[64];
  const int used = std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%09lld",
                                 static_cast<int>(date.year()), unsigned{date.month()},
                                 unsigned{date.day()}, minute_of_day / 60, minute_of_day % 60,
                                 second, static_cast<long long>(units * unit_ns % kSecond_ns));
  const int unwanted = decimals > 0 ? 9 - decimals : 10;  // with their point
  return std::string(text, static_cast<std::size_t>(used - unwanted));
}

bool utc_is_a_guess(Epoch t) noexcept {
  int status = 0;
  leap_seconds(day_of(t), &status);
  return status == 1;
}

TwoPartDate utc_date(Epoch t) noexcept {
  const double ns = static_cast<double>(t.time_since_epoch().count());
  TwoPartDate utc;
  eraTaiutc(kJ2000Date, ns / kNanosecondsPerDay, &utc.day1, &utc.day2);
  return utc;
}

TwoPartDate terrestrial_time(Epoch t) noexcept {
  const double ns = static_cast<double>(t.time_since_epoch().count());
  return {kJ2000Date, (ns + 32.184e9) / kNanosecondsPerDay};
}

}  // namespace engine
