#include "engine/render/noise_map.h"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/sobol.h"

namespace engine {
namespace {

constexpr int kSide = 48;
const PixelRect kRegion{-3, 5, -3 + kSide, 5 + kSide};
const SensorNoise kSensor{100.0, 9.0, 30000.0, 0.68};

std::size_t at(int u, int v) {
  return static_cast<std::size_t>(v) * kSide + static_cast<std::size_t>(u);
}
std::vector<float> map_of(float value) { return std::vector<float>(kSide * kSide, value); }

TEST(NoiseMap, EvenNoiseShrinksByTheSquaredSpreadOfLight) {
  NoiseMap map(kRegion, kSensor);
  // 400 e- and 30 e- of noise a pixel; inside, the sum of h^2 is 1 / (4 pi blur^2).
  const NoiseReached reached = map.measure(kRegion, map_of(4.0F), map_of(0.09F));
  const double after_e = 30.0 / std::sqrt(4.0 * kPi * 0.68 * 0.68);
  EXPECT_NEAR(reached.worst, after_e / std::sqrt(400.0 + 9.0), 0.15);  // the rim is darker
  // Its outermost pixels see up to half of the noise, and less light: one in twelve.
  EXPECT_NEAR(reached.rms / (after_e / std::sqrt(400.0 + 9.0)), 1.0, 0.03);
  EXPECT_EQ(reached.lit_px, kSide * kSide);
  EXPECT_EQ(reached.clipped_px, 0);
}

TEST(NoiseMap, WithoutSpreadNoiseIsThePixelsOwn) {
  SensorNoise sharp = kSensor;
  sharp.blur_px = 0;
  NoiseMap map(kRegion, sharp);
  std::vector<float> mean = map_of(4.0F);
  std::vector<float> variance = map_of(0.0F);
  variance[at(10, 20)] = 0.25F;  // 50 e- rms
  const NoiseReached reached = map.measure(kRegion, mean, variance);
  EXPECT_NEAR(reached.worst, 50.0 / std::sqrt(409.0), 1e-5);
  EXPECT_NEAR(reached.rms, 50.0 / std::sqrt(409.0) / kSide, 1e-6);
}

TEST(NoiseMap, CountsPixelsWhoseErrorStandsOut) {
  SensorNoise sharp = kSensor;
  sharp.blur_px = 0;
  NoiseMap map(kRegion, sharp);
  std::vector<float> variance = map_of(0.01F);
  variance[at(5, 5)] = 1.05F;  // 102.5 e-: five times the root of 409 is 101.1
  variance[at(9, 5)] = 0.97F;  // 98.5 e-
  EXPECT_EQ(map.measure(kRegion, map_of(4.0F), variance).firefly_px, 1);
}

TEST(NoiseMap, OneNoisyPixelIsSpreadOverItsNeighbours) {
  NoiseMap map(kRegion, kSensor);
  std::vector<float> variance = map_of(0.0F);
  variance[at(24, 24)] = 1.0F;
  const NoiseReached reached = map.measure(kRegion, map_of(4.0F), variance);
  // Added up over pixels it is h^2's sum times the variance, in units of sigma^2 = 409.
  const double want = 1e4 / (4.0 * kPi * 0.68 * 0.68) / 409.0;
  EXPECT_NEAR(reached.rms * reached.rms * kSide * kSide / want, 1.0, 1e-4);
}

TEST(NoiseMap, DarkAndClippedPixelsAreNotJudged) {
  SensorNoise sharp = kSensor;
  sharp.blur_px = 0;
  NoiseMap map(kRegion, sharp);
  std::vector<float> mean = map_of(0.0F);
  mean[at(1, 1)] = 4.0F;
  mean[at(2, 1)] = 0.029F;  // 2.9 e-, the dark noise is 3
  mean[at(3, 1)] = 300.0F;  // full
  const NoiseReached reached = map.measure(kRegion, mean, map_of(0.01F));
  EXPECT_EQ(reached.lit_px, 1);
  EXPECT_EQ(reached.clipped_px, 1);
  EXPECT_NEAR(reached.rms, 10.0 / std::sqrt(409.0), 1e-5);
  const NoiseReached none = map.measure(kRegion, map_of(0.0F), map_of(0.01F));
  EXPECT_EQ(none.lit_px, 0);
  EXPECT_EQ(none.rms, 0.0);
}

TEST(NoiseMap, KnowsNothingWithoutASensor) {
  NoiseMap map(kRegion, SensorNoise{});
  EXPECT_TRUE(std::isnan(map.measure(kRegion, map_of(4.0F), map_of(0.09F)).rms));
}

TEST(NoiseMap, PlanMeetsTheLimitAndNotByMuchMore) {
  NoiseMap map(kRegion, kSensor);
  std::vector<float> mean(kSide * kSide);
  std::vector<float> variance(kSide * kSide);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      // A bright and a faint half; noise that varies slowly, as the plan takes it to.
      mean[at(u, v)] = u < kSide / 2 ? 50.0F : 5.0F;
      variance[at(u, v)] = 20.0F + 10.0F * std::sin(0.1F * static_cast<float>(u + v));
    }
  }
  std::vector<std::uint32_t> samples(kSide * kSide);
  for (const double limit : {0.19, 0.063}) {
    map.plan({limit, 1, 1 << 20}, kRegion, mean, variance, samples);
    std::vector<float> after(variance.size());
    for (std::size_t i = 0; i < after.size(); ++i)
      after[i] = variance[i] / static_cast<float>(samples[i]);
    const double reached = map.measure(kRegion, mean, after).rms;
    // Beyond the rim there are no neighbours to average with: of the 8 % of the pixels that stand
    // there the variance is taken to be up to half of what it is.
    EXPECT_LE(reached, limit * 1.02 + 0.003 * limit);
    EXPECT_GE(reached, limit * 0.95);
    // As many samples everywhere would need more of them.
    const double all = std::accumulate(samples.begin(), samples.end(), 0.0);
    for (std::size_t i = 0; i < after.size(); ++i)
      after[i] = variance[i] / static_cast<float>(all / (kSide * kSide));
    EXPECT_GT(map.measure(kRegion, mean, after).rms, reached);
  }
}

TEST(NoiseMap, PlanKeepsItsBounds) {
  NoiseMap map(kRegion, kSensor);
  std::vector<std::uint32_t> samples(kSide * kSide);
  std::vector<float> variance = map_of(1e6F);
  variance[at(40, 40)] = 0.0F;
  map.plan({0.01, 18, 4096}, kRegion, map_of(50.0F), variance, samples);
  for (const std::uint32_t n : samples) EXPECT_EQ(n, 4096U);
  map.plan({0.19, 18, 4096}, kRegion, map_of(50.0F), map_of(0.0F), samples);
  for (const std::uint32_t n : samples) EXPECT_EQ(n, 18U);
  map.plan({0.19, 18, 4096}, kRegion, map_of(0.0F), map_of(1.0F), samples);
  for (const std::uint32_t n : samples) EXPECT_EQ(n, 18U);
}

}  // namespace
}  // namespace engine
