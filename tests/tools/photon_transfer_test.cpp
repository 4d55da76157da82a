#include "tools/characterize/photon_transfer.h"

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"
#include "tools/characterize/image_stack.h"

namespace {

using characterize::ImageStack;
using characterize::LightLevel;
using characterize::PixelMask;
using characterize::Quantity;

/// A sensor that is not the engine's: the standard library's noise, and nothing else to learn from.
struct ToySensor {
  static constexpr int kSide = 96;
  double gain_dn_e = 0.8;
  double efficiency = 0.6;
  double full_well_e = 4000;
  double read_noise_e = 4;
  double pedestal_dn = 60;
  double prnu = 0;
  double bend = 0;  ///< of the response at full well, relative
  std::mt19937 chance{7};
  std::vector<double> response = std::vector<double>(kSide * kSide, 1.0);

  void draw_pattern() {
    std::normal_distribution<double> normal(1.0, prnu);
    for (double& r : response) r = normal(chance);
  }
  engine::DnImage frame(double photons) {
    engine::DnImage image(kSide, kSide);
    std::normal_distribution<double> read(0.0, read_noise_e);
    for (std::size_t i = 0; i < response.size(); ++i) {
      const double mean_e = photons * efficiency * response[i];
      double e = mean_e > 0.0 ? std::poisson_distribution<int>(mean_e)(chance) : 0.0;
      e = std::min(e, full_well_e);
      e *= 1.0 - bend * e / full_well_e;
      image.pixels()[i] = static_cast<std::uint16_t>(
          std::lround(std::max(0.0, pedestal_dn + gain_dn_e * (e + read(chance)))));
    }
    return image;
  }
  ImageStack stack(double photons, int frames) {
    ImageStack all(PixelMask(response.size(), 1));
    for (int i = 0; i < frames; ++i) all.add(frame(photons));
    return all;
  }
  std::vector<LightLevel> levels() {
    std::vector<LightLevel> out;
    for (int i = 0; i <= 54; ++i) {
      const double photons = full_well_e / efficiency * i / 50;
      const ImageStack images = stack(photons, 4);
      out.push_back({1e-9 * photons, photons, images.mean_dn(), images.temporal_variance_dn2(),
                     images.spatial_variance_dn2()});
    }
    return out;
  }
};

void expect_within(const Quantity& q, double truth, double sigmas) {
  EXPECT_NEAR(q.value, truth, sigmas * q.error);
}

TEST(LineFit, FindsALineAndItsErrors) {
  const std::vector<double> x{0, 1, 2, 3};
  const std::vector<double> y{1, 3, 5, 7};
  const std::vector<double> sigma(4, 0.1);
  const characterize::Line line = characterize::fit_line(x, y, sigma);
  EXPECT_NEAR(line.slope.value, 2.0, 1e-12);
  EXPECT_NEAR(line.intercept.value, 1.0, 1e-12);
  // By hand: the spread of x about its middle is 5, its mean square 14 / 4.
  EXPECT_NEAR(line.slope.error, 0.1 / std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(line.intercept.error, 0.1 * std::sqrt(14.0 / 20.0), 1e-12);
}

TEST(PhotonTransfer, FindsGainAndEfficiencyOfASensorThatItKnowsNothingOf) {
  ToySensor sensor;
  const auto transfer = characterize::photon_transfer(sensor.levels());
  expect_within(transfer.gain_dn_e(), 0.8, 4);
  expect_within(transfer.quantum_efficiency, 0.6, 4);
  EXPECT_LT(transfer.gain_dn_e().error, 0.008);
  // The well's edge cuts into the noise some three sigmas, 190 e-, before it is full.
  EXPECT_NEAR(transfer.saturation_e.value, 3800, 150);
}

TEST(PhotonTransfer, IsNotFooledByAnUnevenSensor) {
  ToySensor sensor;
  sensor.prnu = 0.02;
  sensor.draw_pattern();
  expect_within(characterize::photon_transfer(sensor.levels()).gain_dn_e(), 0.8, 4);
}

TEST(PhotonTransfer, TellsAWrongGain) {
  ToySensor sensor;
  sensor.gain_dn_e = 0.8 * 1.05;
  const Quantity gain = characterize::photon_transfer(sensor.levels()).gain_dn_e();
  EXPECT_GT((gain.value - 0.8) / gain.error, 5.0);
}

TEST(PhotonTransfer, TellsABentResponseFromAStraightOne) {
  ToySensor sensor;
  const double straight = characterize::photon_transfer(sensor.levels()).linearity_error.value;
  EXPECT_LT(straight, 1e-3);
  sensor.bend = 0.05;
  EXPECT_GT(characterize::photon_transfer(sensor.levels()).linearity_error.value, 4e-3);
}

TEST(PhotonTransfer, FindsReadNoiseBesideTheQuantisers) {
  ToySensor sensor;
  sensor.gain_dn_e = 0.2;  // .8 DN: the quantiser's share is a ninth
  const Quantity variance = sensor.stack(0.0, 40).temporal_variance_dn2();
  expect_within(characterize::noise_e(variance, {0.2, 0.0}), 4.0, 4);
  EXPECT_GT(std::sqrt(variance.value) / 0.2, 4.2);
}

TEST(PhotonTransfer, RefusesLightThatNeverSaturates) {
  ToySensor sensor;
  std::vector<LightLevel> levels = sensor.levels();
  levels.resize(40);
  EXPECT_THROW((void)characterize::photon_transfer(levels), std::runtime_error);
  EXPECT_THROW((void)characterize::photon_transfer({}), std::runtime_error);
}

TEST(PhotonTransfer, RefusesNoiseThatTheQuantiserHides) {
  ToySensor sensor;
  sensor.gain_dn_e = 0.01;  // at 70 % of saturation .28 DN^2
  EXPECT_THROW((void)characterize::photon_transfer(sensor.levels()), std::runtime_error);
}

TEST(PhotonTransfer, ThresholdIsWhereSignalEqualsNoise) {
  // Noise of 3 e- besides the light's own: n^2 = 9 + n.
  const double n = 0.5 + std::sqrt(9.25);
  const Quantity threshold =
      characterize::sensitivity_threshold({9.0 * 0.25, 0.0}, {0.5, 0.0}, {0.4, 0.0});
  EXPECT_NEAR(threshold.value, n / 0.4, 1e-9);
}

TEST(ImageStack, PartsPatternFromNoise) {
  ToySensor sensor;
  sensor.prnu = 0.01;
  sensor.draw_pattern();
  const ImageStack stack = sensor.stack(3000, 24);  // 1800 e-
  test_support::Moments drawn;
  for (const double r : sensor.response) drawn.add(r);
  expect_within(stack.spatial_variance_dn2(), drawn.variance() * std::pow(1800 * 0.8, 2), 4);
  expect_within(stack.temporal_variance_dn2(), 0.64 * (1800 + 16) + 1.0 / 12, 4);
  sensor.response.assign(sensor.response.size(), 1.0);
  expect_within(sensor.stack(3000, 24).spatial_variance_dn2(), 0.0, 4);
}

TEST(ImageStack, LeavesDefectsOut) {
  ToySensor sensor;
  sensor.response[100] = 0.1;
  ImageStack all(PixelMask(sensor.response.size(), 1));
  PixelMask but_one(sensor.response.size(), 1);
  but_one[100] = 0;
  ImageStack good(but_one);
  for (int i = 0; i < 8; ++i) {
    const engine::DnImage frame = sensor.frame(3000);
    all.add(frame);
    good.add(frame);
  }
  const auto mean = all.mean_image_dn();
  EXPECT_EQ(characterize::outliers(mean, 6.0, 0.0), std::vector<std::size_t>{100});
  EXPECT_EQ(good.pixels() + 1, all.pixels());
  EXPECT_NEAR(good.spatial_variance_dn2().value, 0.0, 4 * good.spatial_variance_dn2().error);
  EXPECT_GT(all.spatial_variance_dn2().value, 4 * good.spatial_variance_dn2().error);
}

}  // namespace
