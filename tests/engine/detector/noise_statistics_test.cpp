// Shot and read noise at 1e8 draws. Seconds each; a sanitizer's build draws fewer.

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/detector/noise_lanes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::histogram_p;

constexpr std::size_t kPixels = std::size_t{1} << 20;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint64_t kFrames = 4;
#else
constexpr std::uint64_t kFrames = 96;  // 1.007e8 pixels
#endif

/// The chance of as bad a histogram from exact Poisson numbers.
double chance_of(double wanted_mean) {
  noise_lanes::Means means;
  means.e_per_w_m2 = 1.0F;
  means.full_well_e = 1e9F;
  means.brim_e = 1e9F;
  const std::vector<float> light(kPixels, static_cast<float>(wanted_mean));
  const auto mean = static_cast<double>(light[0]);
  const double reach = 12.0 * std::sqrt(mean);
  const double least = std::max(0.0, std::floor(mean - reach - 5.0));
  std::vector<std::uint32_t> counts(static_cast<std::size_t>(mean + reach + 30.0 - least));
  std::vector<float> electrons(kPixels);
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    noise_lanes::expose({1, frame, 0}, means, light, electrons);
    for (const float e : electrons)
      ++counts[static_cast<std::size_t>(static_cast<double>(e) - least)];
  }
  std::vector<double> observed(counts.begin(), counts.end());
  std::vector<double> expected(counts.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double k = least + static_cast<double>(i);
    int sign = 1;
    expected[i] = static_cast<double>(kFrames * kPixels) *
                  std::exp(k * std::log(mean) - mean - ::lgamma_r(k + 1.0, &sign));
  }
  return histogram_p(observed, expected);
}

TEST(NoiseStatistics, ChiSquaredCannotTellFewElectronsFromPoisson) {
  for (const double mean : {1e-6, 1e-4, 1e-2, 0.035, 0.3, 1.0, 3.3, 5.0, 6.7, 7.9999})
    EXPECT_GT(chance_of(mean), 1e-3) << mean;
}

TEST(NoiseStatistics, ChiSquaredCannotTellManyElectronsFromPoisson) {
  for (const double mean : {8.0, 8.01, 9.0, 11.5, 16.0, 25.0, 60.0})
    EXPECT_GT(chance_of(mean), 1e-3) << mean;
}

TEST(NoiseStatistics, ChiSquaredCannotTellBrightPixelsFromPoisson) {
  for (const double mean : {100.0, 1e3, 1.6e4, 1e5, 1e6}) EXPECT_GT(chance_of(mean), 1e-3) << mean;
}

TEST(NoiseStatistics, ChiSquaredCannotTellReadNoiseFromGauss) {
  // Bins of .01 sigma to 6 sigma.
  constexpr int kBins = 1200;
  std::vector<double> observed(kBins, 0.0);
  std::vector<float> numbers(kPixels);
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    noise_lanes::normals({1, frame, 0}, Stream::kRead, numbers);
    for (const float x : numbers)
      observed[static_cast<std::size_t>(
          std::clamp((static_cast<double>(x) + 6.0) * 100.0, 0.0, kBins - 1.0))] += 1.0;
  }
  std::vector<double> expected(kBins);
  const auto below = [](double w) { return 0.5 * std::erfc(-w / std::sqrt(2.0)); };
  for (int i = 0; i < kBins; ++i) {
    // From the nearer end, and what is beyond the last bins in them.
    const double a = std::abs(i + 0.5 - 0.5 * kBins) * 0.01 - 0.005;
    const double last = i == 0 || i == kBins - 1 ? 0.0 : below(-a - 0.01);
    expected[static_cast<std::size_t>(i)] =
        static_cast<double>(kFrames * kPixels) * (below(-a) - last);
  }
  EXPECT_GT(histogram_p(observed, expected), 1e-3);
}

}  // namespace
}  // namespace engine
