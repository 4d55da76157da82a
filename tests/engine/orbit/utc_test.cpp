#include "engine/orbit/utc.h"

#include <string>

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

TEST(Utc, ReadsBackWhatItWritesToTheNanosecond) {
  for (const char* text : {"1972-06-30T23:59:60.999999999", "2016-12-31T23:59:59.999999999",
                           "2016-12-31T23:59:60.000000000", "2016-12-31T23:59:60.000000001",
                           "2016-12-31T23:59:60.999999999", "2017-01-01T00:00:00.000000000",
                           "2022-01-04T14:02:41.630163217", "2280-12-31T23:59:59.999999999"})
    EXPECT_EQ(utc_text(epoch(text), 9), text);
}

TEST(Utc, TextsGrowWithTheNanosecondsAcrossALeapSecond) {
  // Around both ends of the second, by the digits' own order.
  for (const char* edge : {"2016-12-31T23:59:60", "2017-01-01T00:00:00"}) {
    std::string before;
    for (int ns = -1000; ns <= 1000; ++ns) {
      const Epoch t = epoch(edge) + Duration(ns);
      const std::string text = utc_text(t, 9);
      ASSERT_LT(before, text) << edge << " " << ns;
      ASSERT_EQ(epoch(text), t) << text;
      before = text;
    }
  }
}

TEST(Utc, RoundsIntoALeapSecondAndOutOfIt) {
  EXPECT_EQ(utc_text(epoch("2016-12-31T23:59:59.9996")), "2016-12-31T23:59:60.000");
  EXPECT_EQ(utc_text(epoch("2016-12-31T23:59:60.9996")), "2017-01-01T00:00:00.000");
  EXPECT_EQ(utc_text(epoch("2016-12-31T23:59:60.9994")), "2016-12-31T23:59:60.999");
  EXPECT_EQ(utc_text(epoch("2016-12-31T23:59:60.4"), 0), "2016-12-31T23:59:60");
}

TEST(Utc, TakesTheDayOfTheYear) {
  EXPECT_EQ(epoch("2022-001T00:00:00"), epoch("2022-01-01T00:00:00"));
  EXPECT_EQ(epoch("2020-366T23:59:59.5Z"), epoch("2020-12-31T23:59:59.5"));
  EXPECT_EQ(epoch("2016-366T23:59:60"), epoch("2016-12-31T23:59:60"));
  for (const char* text : {"2022-000T00:00:00", "2022-366T00:00:00", "2022-1T00:00:00"})
    EXPECT_FALSE(epoch_from_utc(text).has_value()) << text;
}

TEST(Utc, OtherScalesAreAFixedDistanceFromTai) {
  const auto in = [](TimeScale scale) {
    return epoch_from_text("2022-01-01T00:00:00", scale).value();
  };
  EXPECT_EQ(in(TimeScale::kUtc)-in(TimeScale::kTai), std::chrono::seconds(37));
  EXPECT_EQ(in(TimeScale::kTai)-in(TimeScale::kTt), std::chrono::milliseconds(32184));
  EXPECT_EQ(in(TimeScale::kGps)-in(TimeScale::kTai), std::chrono::seconds(19));
  // A leap second is UTC's alone, and so is the Z.
  for (const TimeScale scale : {TimeScale::kTai, TimeScale::kTt, TimeScale::kGps}) {
    EXPECT_FALSE(epoch_from_text("2016-12-31T23:59:60", scale).has_value());
    EXPECT_FALSE(epoch_from_text("2016-12-31T23:59:59Z", scale).has_value());
  }
}

TEST(Utc, SaysWhenTheTableOfLeapSecondsIsTooOldToKnow) {
  EXPECT_FALSE(utc_is_a_guess(epoch("2016-12-31T23:59:60")));
  EXPECT_FALSE(utc_is_a_guess(epoch("2022-01-16T00:00:00")));
  EXPECT_TRUE(utc_is_a_guess(epoch("2100-01-01T00:00:00")));
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
                           "99999-01-01T00:00:00",
                           "0000-01-01T00:00:00",
                           "2281-01-01T00:00:00",
                           "1e9",
                           "1000000000-01-01T00:00:00",
                           "2022-1-1T0:0:0",
                           "+022-01-01T00:00:00",
                           "2022-01-01T 1:00:00",
                           "2022-01-01T00:00:0x1",
                           "2022-01-01T00:00:1e1",
                           "2022-01-01T00:00:00.",
                           "2022-01-01T00:00:00.0000000001",
                           "2016-12-31T23:59:61",
                           "2016-12-31T22:59:60",
                           "2016-12-30T23:59:60",
                           "2022-01-01T00:00:00ZZ",
                           "NaN"})
    EXPECT_FALSE(epoch_from_utc(text).has_value()) << "\"" << text << "\"";
  using namespace std::string_literals;
  EXPECT_FALSE(epoch_from_utc("2022-01-01T00:00:00\0"s).has_value());
  EXPECT_FALSE(epoch_from_utc("2022-01-01\0T00:00:00"s).has_value());
  EXPECT_FALSE(epoch_from_utc(std::string(1 << 20, '9')).has_value());
}

TEST(TerrestrialTime, Is32184MillisecondsAheadOfTai) {
  const TwoPartDate j2000 = terrestrial_time(Epoch{});
  EXPECT_EQ(j2000.day1, 2451545.0);
  EXPECT_DOUBLE_EQ(j2000.day2 * 86400.0, 32.184);
}

}  // namespace
}  // namespace engine
