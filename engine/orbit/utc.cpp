#include "engine/orbit/utc.h"

#include <erfa.h>
#include <cstdio>

namespace engine {
namespace {

constexpr double kJ2000Date = 2451545.0;
constexpr double kNanosecondsPerDay = 86400e9;
constexpr int kFirstUtcYear = 1972;  // before, UTC ran at another rate than TAI

}  // namespace

std::optional<Epoch> epoch_from_utc(const std::string& text) noexcept {
  int year = 0;
  int month = 0;
  int day = 0;
  int hour = 0;
  int minute = 0;
  double second = 0;
  int used = 0;
  const int fields = std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%12lf%n", &year, &month, &day,
                                 &hour, &minute, &second, &used);
  const std::string rest = fields == 6 ? text.substr(static_cast<std::size_t>(used)) : "?";
  if (fields != 6 || year < kFirstUtcYear || !(rest.empty() || rest == "Z")) return std::nullopt;
  double utc1 = 0;
  double utc2 = 0;
  double tai1 = 0;
  double tai2 = 0;
  // +1 warns that the leap table ends before this year; a negative status, or a time of day past
  // the end of that day (+2), is no date.
  const int status = eraDtf2d("UTC", year, month, day, hour, minute, second, &utc1, &utc2);
  if (status < 0 || status > 1 || eraUtctai(utc1, utc2, &tai1, &tai2) < 0) return std::nullopt;
  const double days = tai1 - kJ2000Date;  // exact: both are multiples of a half
  return Epoch(Duration(std::llround(days * kNanosecondsPerDay)) +
               Duration(std::llround(tai2 * kNanosecondsPerDay)));
}

TwoPartDate utc_date(Epoch t) noexcept {
  const double ns = static_cast<double>(t.time_since_epoch().count());
  TwoPartDate utc;
  eraTaiutc(kJ2000Date, ns / kNanosecondsPerDay, &utc.day1, &utc.day2);
  return utc;
}

std::string utc_text(Epoch t) {
  const TwoPartDate utc = utc_date(t);
  int year = 0;
  int month = 0;
  int day = 0;
  int clock[4] = {};
  eraD2dtf("UTC", 3, utc.day1, utc.day2, &year, &month, &day, clock);
  char text[40];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02d.%03d", year, month, day, clock[0],
                clock[1], clock[2], clock[3]);
  return text;
}

TwoPartDate terrestrial_time(Epoch t) noexcept {
  constexpr double kTtMinusTai_ns = 32.184e9;
  const double ns = static_cast<double>(t.time_since_epoch().count());
  return {kJ2000Date, (ns + kTtMinusTai_ns) / kNanosecondsPerDay};
}

}  // namespace engine
