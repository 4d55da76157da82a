#include "engine/orbit/utc.h"

#include <gtest/gtest.h>

#include "engine/core/time.h"

namespace engine {
namespace {

Epoch epoch(const std::string& text) {
  const auto found = epoch_from_utc(text);
  EXPECT_TRUE(found.has_value()) << text;
  return found.value_or(Epoch{});
}

TEST(Utc, IsThirtySevenSecondsBehindTaiIn2022) {
  // 8036 days from 2000-01-01 to 2022-01-01, from noon on.
  const Duration since_j2000 = std::chrono::hours(8036 * 24 - 12) + std::chrono::seconds(37);
  EXPECT_EQ(epoch("2022-01-01T00:00:00").time_since_epoch(), since_j2000);
}

TEST(Utc, HasALeapSecondAtTheEndOf2016) {
  const Epoch second_59 = epoch("2016-12-31T23:59:59");
  const Epoch second_60 = epoch("2016-12-31T23:59:60");
  const Epoch new_year = epoch("2017-01-01T00:00:00");
  EXPECT_EQ(second_60 - second_59, std::chrono::seconds(1));
  EXPECT_EQ(new_year - second_60, std::chrono::seconds(1));
}

TEST(Utc, IsMonotoneToTheNanosecondAcrossALeapSecond) {
  EXPECT_EQ(epoch("2016-12-31T23:59:60") - epoch("2016-12-31T23:59:59.999999999"), Duration(1));
  EXPECT_EQ(epoch("2017-01-01T00:00:00") - epoch("2016-12-31T23:59:60.999999999"), Duration(1));
  EXPECT_EQ(epoch("2022-01-01T00:00:00.000000001") - epoch("2022-01-01T00:00:00"), Duration(1));
}

TEST(Utc, ReadsBackWhatItWrites) {
  for (const char* text :
       {"1972-01-01T00:00:00.000", "2000-02-29T23:59:59.999", "2016-12-31T23:59:60.500",
        "2022-01-04T14:02:41.630", "2022-12-31T23:59:59.999", "2049-12-31T18:00:00.000"})
    EXPECT_EQ(utc_text(epoch(text)), text);
}

TEST(Utc, RoundsToTheNextDayAndNotToSecondSixty) {
  EXPECT_EQ(utc_text(epoch("2022-03-01T23:59:59.9996")), "2022-03-02T00:00:00.000");
}

TEST(Utc, TakesAZAtTheEnd) {
  EXPECT_EQ(epoch("2022-01-01T00:00:00Z"), epoch("2022-01-01T00:00:00"));
}

TEST(Utc, RefusesWhatIsNoDate) {
  for (const char* text : {"",
                           "today",
                           "2022-01-01",
                           "2022-13-01T00:00:00",
                           "2022-00-10T00:00:00",
                           "2022-02-30T00:00:00",
                           "2021-02-29T00:00:00",
                           "2022-01-32T00:00:00",
                           "2022-01-01T24:00:00",
                           "2022-01-01T00:60:00",
                           "2022-01-01T23:59:60",
                           "2022-01-01T00:00:61",
                           "2022-01-01T00:00:-1",
                           "2022-01-01T00:-1:00",
                           "2022-01-01T00:00:nan",
                           "2022-01-01T00:00:inf",
                           "2022-01-01T00:00:00+01:00",
                           "2022-01-01T00:00:00 ",
                           "1971-12-31T23:59:59",
                           "-2022-01-01T00:00:00",
                           "99999-01-01T00:00:00"})
    EXPECT_FALSE(epoch_from_utc(text).has_value()) << "\"" << text << "\"";
}

TEST(TerrestrialTime, Is32184MillisecondsAheadOfTai) {
  const TwoPartDate j2000 = terrestrial_time(Epoch{});
  EXPECT_EQ(j2000.day1, 2451545.0);
  EXPECT_DOUBLE_EQ(j2000.day2 * 86400.0, 32.184);
}

}  // namespace
}  // namespace engine
