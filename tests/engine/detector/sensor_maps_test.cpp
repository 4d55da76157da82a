#include "engine/detector/sensor_maps.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/fits_bytes.h"
#include "tests/support/statistics.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using test_support::Moments;

constexpr int kSide_px = 512;
constexpr double kPixels = kSide_px * kSide_px;

SensorMaps maps_of(const DetectorSpec& spec) { return {spec, kSide_px, kSide_px}; }

bool equal(std::span<const float> a, std::span<const float> b) { return std::ranges::equal(a, b); }

DetectorSpec uneven() {
  DetectorSpec spec;
  spec.prnu_rms = 0.01;
  spec.dsnu_rms = 0.3;
  spec.hot_pixels = 0.002;
  spec.dead_pixels = 0.001;
  spec.hot_columns = 2;
  spec.dead_columns = 3;
  return spec;
}

TEST(SensorMaps, OfAnEvenSensorTakeNoMemory) {
  DetectorSpec spec;
  spec.background_e_s = 10;
  const SensorMaps maps = maps_of(spec);
  EXPECT_TRUE(maps.response().empty());
  EXPECT_TRUE(maps.dark_e_s().empty());
  spec.prnu_rms = 0.01;
  EXPECT_TRUE(maps_of(spec).dark_e_s().empty());  // one map, not two
}

TEST(SensorMaps, AreTheSensorsOwn) {
  DetectorSpec spec = uneven();
  const SensorMaps a = maps_of(spec);
  const SensorMaps again = maps_of(spec);
  EXPECT_TRUE(equal(a.response(), again.response()));
  EXPECT_TRUE(equal(a.dark_e_s(), again.dark_e_s()));
  spec.sensor = 2;
  const SensorMaps b = maps_of(spec);
  const std::vector<double> x(a.response().begin(), a.response().end());
  const std::vector<double> y(b.response().begin(), b.response().end());
  int same = 0;
  for (std::size_t i = 0; i < x.size(); ++i) same += x[i] == y[i] ? 1 : 0;
  EXPECT_LT(same, 100);  // dead in both, or by chance
}

TEST(SensorMaps, HaveTheMomentsThatWereAskedFor) {
  for (const double rms : {0.01, 0.3}) {
    DetectorSpec spec;
    spec.prnu_rms = std::min(rms, 0.1);
    spec.dsnu_rms = rms;
    const SensorMaps maps = maps_of(spec);
    Moments response;
    Moments dark;
    for (const float x : maps.response()) response.add(static_cast<double>(x));
    for (const float x : maps.dark_e_s()) {
      ASSERT_GT(x, 0.0F);
      dark.add(static_cast<double>(x) / spec.dark_e_s);
    }
    const double prnu = spec.prnu_rms;
    EXPECT_NEAR(response.mean(), 1.0, 4.5 * prnu / std::sqrt(kPixels));
    EXPECT_NEAR(std::sqrt(response.variance()), prnu, 4.5 * prnu / std::sqrt(2.0 * kPixels));
    EXPECT_NEAR(dark.mean(), 1.0, 4.5 * rms / std::sqrt(kPixels));
    // The kurtosis of a log-normal number widens the variance's own spread: at .3 it is 4.6.
    EXPECT_NEAR(std::sqrt(dark.variance()), rms, 4.5 * 1.1 * rms / std::sqrt(kPixels));
    const std::vector<double> x(maps.response().begin(), maps.response().end());
    const std::vector<double> y(maps.dark_e_s().begin(), maps.dark_e_s().end());
    const double limit = 4.5 / std::sqrt(kPixels);
    EXPECT_LT(std::abs(test_support::correlation(x, y)), limit);
    for (const std::size_t lag : {1U, 2U, 512U})
      EXPECT_LT(std::abs(test_support::correlation(std::span(x).first(x.size() - lag),
                                                   std::span(x).subspan(lag))),
                limit);
  }
}

TEST(SensorMaps, HotPixelsAreTheirShareAndExponential) {
  DetectorSpec spec;
  spec.dark_e_s = 0;
  spec.hot_pixels = 0.01;
  spec.hot_dark_e_s = 5000;
  spec.dark_doubling_c = 10;
  spec.temperature_c = 10;  // twice as hot
  Moments hot;
  const SensorMaps maps = maps_of(spec);
  for (const float x : maps.dark_e_s())
    if (x > 0.0F) hot.add(static_cast<double>(x));
  const auto count = static_cast<double>(hot.count());
  EXPECT_NEAR(count, 0.01 * kPixels, 4.5 * std::sqrt(0.01 * kPixels));
  EXPECT_NEAR(hot.mean(), 1e4, 4.5 * 1e4 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(hot.variance()), 1e4, 4.5 * 1e4 * std::sqrt(2.0 / count));
}

TEST(SensorMaps, DeadPixelsCollectNothing) {
  DetectorSpec spec;
  spec.dead_pixels = 0.02;
  spec.background_e_s = 7;
  const SensorMaps maps = maps_of(spec);
  int dead = 0;
  for (std::size_t i = 0; i < maps.response().size(); ++i) {
    if (maps.response()[i] > 0.0F) {
      ASSERT_EQ(maps.dark_e_s()[i], 42.0F);
      continue;
    }
    ++dead;
    ASSERT_EQ(maps.dark_e_s()[i], 0.0F);
  }
  EXPECT_NEAR(dead, 0.02 * kPixels, 4.5 * std::sqrt(0.02 * kPixels));
}

TEST(SensorMaps, ColumnsAreHotOrDeadFromEndToEnd) {
  DetectorSpec spec;
  spec.hot_columns = 5;
  spec.dead_columns = 4;
  const SensorMaps maps = maps_of(spec);
  int hot = 0;
  int dead = 0;
  for (std::size_t u = 0; u < kSide_px; ++u) {
    for (std::size_t v = 1; v < kSide_px; ++v) {
      ASSERT_EQ(maps.response()[v * kSide_px + u], maps.response()[u]);
      ASSERT_EQ(maps.dark_e_s()[v * kSide_px + u], maps.dark_e_s()[u]);
    }
    dead += maps.response()[u] == 0.0F ? 1 : 0;
    hot += maps.dark_e_s()[u] > 35.0F ? 1 : 0;
  }
  EXPECT_EQ(hot, 5);
  EXPECT_EQ(dead, 4);
}

TEST(SensorMaps, DoNotHaveMoreColumnsThanTheCamera) {
  DetectorSpec spec;
  spec.hot_columns = 300;
  spec.dead_columns = 213;
  spec.columns_where = "x.toml:3: detector.dead_columns";
  try {
    maps_of(spec);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_STREQ(
        e.what(),
        "x.toml:3: detector.dead_columns must leave hot and dead columns within the 512 of "
        "the camera, got 513");
  }
}

TEST(SensorMaps, AWindowHasThePixelsOfTheWholeSensor) {
  const SensorMaps whole = maps_of(uneven());
  const PixelRect window{100, 37, 164, 90};
  const SensorMaps part = whole.cut(window);
  ASSERT_EQ(part.response().size(), 64U * 53U);
  for (int v = window.top; v < window.bottom; ++v)
    for (int u = window.left; u < window.right; ++u) {
      const auto here = static_cast<std::size_t>((v - window.top) * 64 + u - window.left);
      const auto there = static_cast<std::size_t>(v * kSide_px + u);
      ASSERT_EQ(part.response()[here], whole.response()[there]);
      ASSERT_EQ(part.dark_e_s()[here], whole.dark_e_s()[there]);
    }
  EXPECT_TRUE(maps_of({}).cut(window).response().empty());
}

TEST(SensorMaps, TakeTheUsersFiles) {
  const test_support::TempFile file(
      "maps.fits", test_support::fits_bytes(-32, {3, 2}, {1.0, 0.5, 0.0, 1.25, 2.0, 1.0}));
  DetectorSpec spec;
  spec.prnu_map = {file.path(), ""};
  spec.dsnu_map = spec.prnu_map;
  spec.background_e_s = 5;
  const SensorMaps maps(spec, 3, 2);
  const std::vector<float> response{1.0F, 0.5F, 0.0F, 1.25F, 2.0F, 1.0F};
  EXPECT_TRUE(equal(maps.response(), response));
  const std::vector<float> dark{40.0F, 22.5F, 5.0F, 48.75F, 75.0F, 40.0F};
  EXPECT_TRUE(equal(maps.dark_e_s(), dark));
}

TEST(SensorMaps, NameThePixelThatIsWrong) {
  for (const double wrong : {-0.5, 11.0, std::nan(""), static_cast<double>(INFINITY)}) {
    const test_support::TempFile file(
        "wrong.fits", test_support::fits_bytes(-64, {3, 2}, {1.0, 1.0, 1.0, 1.0, wrong, 1.0}));
    DetectorSpec spec;
    spec.prnu_map = {file.path(), "x.toml:7: detector.prnu_map"};
    try {
      const SensorMaps maps(spec, 3, 2);
      FAIL() << wrong;
    } catch (const ConfigError& e) {
      const std::string want = "x.toml:7: detector.prnu_map: " + file.path() +
                               ": pixel (1, 1), from 0, must be >= 0 and <= 10, got ";
      EXPECT_EQ(std::string(e.what()).substr(0, want.size()), want);
    }
  }
}

TEST(SensorMaps, SayWhichKeyNamesABadFile) {
  DetectorSpec spec;
  spec.dsnu_map = {"/nowhere/dark.fits", "x.toml:9: detector.dsnu_map"};
  try {
    maps_of(spec);
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(), "x.toml:9: detector.dsnu_map: /nowhere/dark.fits: cannot be read");
  }
}

TEST(SensorMaps, BinnedPixelsAreTheirPhotosites) {
  const DetectorSpec spec = uneven();
  const SensorMaps fine = maps_of(spec);
  const SensorMaps coarse = fine.binned(2);
  ASSERT_EQ(coarse.response().size(), fine.response().size() / 4);
  for (const int place : {0, 255, 1000, 65535}) {
    const int u = 2 * (place % 256);
    const int v = 2 * (place / 256);
    double response = 0;
    double dark_e_s = 0;
    for (const int site : {0, 1, kSide_px, kSide_px + 1}) {
      const auto at = static_cast<std::size_t>(v * kSide_px + u + site);
      response += static_cast<double>(fine.response()[at]) / 4.0;
      dark_e_s += static_cast<double>(fine.dark_e_s()[at]);
    }
    const auto at = static_cast<std::size_t>(place);
    EXPECT_NEAR(static_cast<double>(coarse.response()[at]), response, 1e-6);
    EXPECT_NEAR(static_cast<double>(coarse.dark_e_s()[at]), dark_e_s, 1e-4 * dark_e_s + 1e-6);
  }
  EXPECT_TRUE(equal(fine.binned(1).dark_e_s(), fine.dark_e_s()));
  EXPECT_TRUE(SensorMaps().binned(2).response().empty());
  // Four times the dark current, without maps, too.
  DetectorSpec binned;
  binned.background_e_s = 7;
  const double one_e = binned.dark_mean_e(std::chrono::milliseconds(50));
  binned.binning = 2;
  EXPECT_DOUBLE_EQ(binned.dark_mean_e(std::chrono::milliseconds(50)), 4.0 * one_e);
}

}  // namespace
}  // namespace engine
