#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/faulty_sink.h"
#include "tests/support/faulty_line.h"

namespace {

using namespace faulty_line;
using hil::FaultKind;
using hil::Frame;

TEST(Faults, AFrozenPictureIsTheLastThatWasNotWhileHeadersGoOn) {
  Head head("[faults.frozen]\nfrom_frame = 4\nto_frame = 7");
  head.send_all(10);
  for (std::uint64_t k = 0; k < 10; ++k) {
    const bool frozen = k >= 4 && k < 7;
    EXPECT_TRUE(is_clean(head.cable.got[k], frozen ? 3 : k)) << k;
    EXPECT_EQ(head.cable.got[k].sequence, k);
    EXPECT_EQ(head.cable.got[k].telemetry_row[0], k);
    EXPECT_EQ(head.cable.got[k].address == &head.slot_of(k), !frozen);
  }
  ASSERT_EQ(head.records.size(), 3U);
  for (const FaultRecord& r : head.records) EXPECT_EQ(r.amount, 3.0);
}

TEST(Faults, TheFirstFrameIsNeitherFrozenNorTornForThereIsNoneBefore) {
  Head head("[faults.frozen]\nto_frame = 1\n[faults.torn]\nto_frame = 1");
  head.send_all(2);
  EXPECT_TRUE(is_clean(head.cable.got[0], 0));
  EXPECT_TRUE(is_clean(head.cable.got[1], 1));
  EXPECT_TRUE(head.records.empty());
}

TEST(Faults, ATornPictureEndsInTheWholeFrameBeforeItHoweverManyAreTornInARow) {
  Head head("[faults.torn]\nfrom_frame = 2");
  head.send_all(200);
  const auto records = head.by_frame();
  EXPECT_EQ(records.size(), 198U);
  std::vector<int> torn_at(kHeight);
  for (std::uint64_t k = 2; k < 200; ++k) {
    const int first = static_cast<int>(records.at(k).place);
    ASSERT_GE(first, 1);
    ASSERT_LT(first, kHeight);
    EXPECT_EQ(records.at(k).count, kHeight - first);
    ++torn_at[static_cast<std::size_t>(first)];
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        ASSERT_EQ(pixel(head.cable.got[k], u, v), shown(v < first ? k : k - 1, u, v)) << k;
  }
  // 198 tears over 15 rows: none is left out but with a chance of 15 (14/15)^198 = 2e-5.
  for (int v = 1; v < kHeight; ++v) EXPECT_GT(torn_at[static_cast<std::size_t>(v)], 0) << v;
}

TEST(Faults, AFrameThatIsDroppedIsNotTheOneBefore) {
  Head head("[faults.dropped]\nfrom_frame = 3\nto_frame = 4\n[faults.frozen]\nfrom_frame = 4");
  head.send_all(6);
  EXPECT_TRUE(is_clean(head.cable.got.back(), 2));
}

TEST(Faults, StuckColumnsShowOneValueAndNothingElseChanges) {
  Head head("[faults.stuck_column]\ncolumn = 5\ncolumns = 2\ndn = 1234");
  head.send_all(3);
  for (std::uint64_t k = 0; k < 3; ++k)
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        EXPECT_EQ(pixel(head.cable.got[k], u, v), u == 5 || u == 6 ? 1234 : shown(k, u, v));
  ASSERT_EQ(head.records.size(), 6U);
  EXPECT_EQ(head.records[0].place, 5);
  EXPECT_EQ(head.records[1].place, 6);
  EXPECT_EQ(head.records[0].amount, 1234.0);
  EXPECT_EQ(head.records[0].count, kHeight);
}

TEST(Faults, HotColumnsAddUpToFullScaleAndNotBeyond) {
  Head head("[faults.hot_column]\ncolumn = 0\ndn = 1000");
  head.send_all(8);
  for (std::uint64_t k = 0; k < 8; ++k)
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        EXPECT_EQ(pixel(head.cable.got[k], u, v),
                  u == 0 ? std::min(shown(k, u, v) + 1000, kFullScale) : shown(k, u, v));
  EXPECT_EQ(head.records.size(), 8U);
}

TEST(Faults, ColumnsThatAreDrawnAreDistinctAndStayWhereTheyAre) {
  const FaultSpec spec = faults("[faults.hot_column]\ncolumns = 20\ndn = 9", 3);
  std::vector<int> columns = spec.faults[0].columns;
  ASSERT_EQ(columns.size(), 20U);
  std::sort(columns.begin(), columns.end());
  EXPECT_EQ(std::adjacent_find(columns.begin(), columns.end()), columns.end());
  EXPECT_GE(columns.front(), 0);
  EXPECT_LT(columns.back(), kWidth);
  EXPECT_NE(columns, faults("[faults.hot_column]\ncolumns = 20\ndn = 9", 4).faults[0].columns);
}

TEST(Faults, RaysAreAsManyAsSaidAndWhatTheyAddIsInTheRecords) {
  constexpr std::uint64_t kFrames = 1000;
  Head head("[faults.rays]\ntracks = 2.5\nlength_px = 6\ndn_per_px = 100");
  head.send_all(kFrames);
  // Poisson: the variance is the mean.
  EXPECT_NEAR(static_cast<double>(head.records.size()), 2500.0, 5.0 * 50.0);
  std::vector<std::int64_t> added(kFrames);
  std::vector<int> tracks(kFrames);
  for (const FaultRecord& r : head.records) {
    added[r.frame] += static_cast<std::int64_t>(r.amount);
    ++tracks[r.frame];
    EXPECT_GE(r.count, 1);
    EXPECT_LT(r.place, kWidth * kHeight);
    EXPECT_GE(r.amount, 0.0);
  }
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    std::int64_t sum = 0;
    int lower = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const int more = pixel(head.cable.got[k], u, v) - shown(k, u, v);
        sum += more;
        lower += more < 0 ? 1 : 0;
        EXPECT_LE(pixel(head.cable.got[k], u, v), kFullScale);
      }
    EXPECT_EQ(sum, added[k]) << k;
    EXPECT_EQ(lower, 0);
    EXPECT_EQ(head.cable.got[k].address == &head.slot_of(k), tracks[k] == 0);
  }
}

// On a field so large that few tracks reach its edge: length and charge have their means.
TEST(Faults, ARayIsAStraightLineWithItsMeanLengthAndCharge) {
  constexpr int kTracks = 4000;
  DnImage image(1024, 1024);
  double length_px = 0;
  double charge_dn = 0;
  int inside = 0;
  for (std::uint32_t i = 0; i < kTracks; ++i) {
    engine::Draws draws(5, engine::Stream::kFaults, i, 9);
    std::fill(image.pixels().begin(), image.pixels().end(), std::uint16_t{0});
    const hil::RayTrack track = hil::add_ray(draws, 20.0, 300.0, 65535, image);
    const int u = static_cast<int>(track.start % 1024);
    const int v = static_cast<int>(track.start / 1024);
    const int reach = std::min(std::min(u, 1023 - u), std::min(v, 1023 - v));
    if (reach < 250) continue;  // a chance of e^-12.5 to be longer
    ++inside;
    std::int64_t sum = 0;
    int touched = 0;
    for (const std::uint16_t dn : image.pixels()) {
      sum += dn;
      touched += dn > 0 ? 1 : 0;
    }
    ASSERT_EQ(sum, track.added_dn);
    ASSERT_EQ(touched, track.pixels);
    length_px += track.pixels;
    charge_dn += static_cast<double>(track.added_dn) / track.pixels;
    if (inside == 60) break;
  }
  ASSERT_EQ(inside, 60);
  // Steps go along the longer axis: a length l touches l E[max(|cos|, |sin|)] = .9003 l pixels, and
  // the one it starts in, less half of what is cut off: 20 * .9003 + .5 = 18.5. An exponential's
  // sigma is its mean: 5 sigma of 60 are 65 %.
  EXPECT_NEAR(length_px / 60, 18.5, 18.5 * 0.65);
  EXPECT_NEAR(charge_dn / 60, 300.0, 300.0 * 0.65);
}

TEST(Faults, FullScaleBleedsUpAndDownItsColumnAsFarAsTheRunIsLong) {
  Head head("[faults.blooming]\nbleed = 1.5");
  head.paint = [](std::uint64_t k, int u, int v) {
    if (k == 1) return static_cast<std::uint16_t>(100);
    const bool bright = (u == 3 && (v == 7 || v == 8)) || (u == 10 && v == 0) ||
                        (u == 12 && (v == 4 || v == 6)) || (u == 20 && v == 15);
    return static_cast<std::uint16_t>(bright ? kFullScale : 100);
  };
  head.send_all(2);
  const auto wet = [](int u, int v) {
    if (u == 3) return v >= 4 && v < 12;   // a run of two, three each way
    if (u == 10) return v < 3;             // one, at the edge: two down
    if (u == 12) return v >= 2 && v <= 8;  // two runs of one
    if (u == 20) return v >= 13;
    return false;
  };
  int changed = -6;  // were bright before
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      EXPECT_EQ(pixel(head.cable.got[0], u, v), wet(u, v) ? kFullScale : 100) << u << " " << v;
      changed += wet(u, v) ? 1 : 0;
    }
  ASSERT_EQ(head.records.size(), 1U) << "nothing at full scale, nothing happens";
  EXPECT_EQ(head.records[0].place, 6);
  EXPECT_EQ(head.records[0].count, changed);
  EXPECT_EQ(head.cable.got[1].address, &head.slot_of(1));
}

TEST(Faults, EachBitIsWrongAtTheRateAndTheRecordCountsThem) {
  constexpr std::uint64_t kFrames = 200;
  constexpr double kRate = 0.002;
  Head head("[faults.flipped]\nbit_error_rate = 0.002");
  head.send_all(kFrames);
  const auto records = head.by_frame();
  std::vector<double> per_bit(kBits);
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    int wrong = 0;
    std::int64_t first = -1;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const unsigned differ =
            static_cast<unsigned>(pixel(head.cable.got[k], u, v)) ^ shown(k, u, v);
        EXPECT_LE(differ, static_cast<unsigned>(kFullScale));
        wrong += std::popcount(differ);
        if (differ != 0 && first < 0) first = v * kWidth + u;
        for (std::size_t bit = 0; bit < kBits; ++bit) per_bit[bit] += (differ >> bit) & 1U;
      }
    EXPECT_EQ(records.contains(k), wrong > 0);
    if (wrong == 0) continue;
    EXPECT_EQ(records.at(k).count, wrong);
    EXPECT_EQ(records.at(k).place, first);
  }
  const double tries = static_cast<double>(kFrames) * kWidth * kHeight;
  for (const double count : per_bit) EXPECT_NEAR(count, tries * kRate, five_sigma(tries, kRate));
}

TEST(Faults, BitsGoWrongInAFrozenPictureTooAndDoNotStay) {
  Head head(
      "[faults.frozen]\nfrom_frame = 1\n[faults.flipped]\nbit_error_rate = 0.01\nto_frame = 3");
  head.send_all(5);
  EXPECT_FALSE(is_clean(head.cable.got[1], 0));
  EXPECT_NE(head.cable.got[1].pixels, head.cable.got[2].pixels);
  EXPECT_TRUE(is_clean(head.cable.got[3], 0));
  EXPECT_TRUE(is_clean(head.cable.got[4], 0));
}

}  // namespace
