#include "engine/orbit/signal_limit.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

SignalLimit paper_camera() {
  SignalLimit limit;
  limit.least_snr = 5.0;
  limit.radius_m = 2.0;
  limit.albedo = 0.2;
  limit.sun_w_m2 = 623.677;
  // .36 m of aperture, .7 through the optics, .55 to electrons, 626.78 nm, 1 ms.
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / 626.78e-9;
  limit.electrons_per_w_m2 = kPi / 4.0 * 0.36 * 0.36 * 0.7 * 0.55 * 1e-3 / photon_j;
  limit.dark_noise_e = 5.0;
  limit.ifov_rad = 6.5e-6 / 4.5;
  return limit;
}

TEST(SignalLimit, IsALambertBallFarAwayAndItsRadianceNearBy) {
  const SignalLimit limit = paper_camera();
  // Fully lit it sends 2/3 albedo E (radius / range)^2, .4 of which is in one pixel.
  const double far_m = 1e9;
  const double pupil_w_m2 = 2.0 / 3.0 * 0.2 * 623.677 * std::pow(2.0 / far_m, 2);
  EXPECT_NEAR(limit.signal_e(far_m, 0.0) / (0.4 * limit.electrons_per_w_m2 * pupil_w_m2), 1.0,
              1e-5);
  // Half of its disc lit: 1 / pi of that.
  EXPECT_NEAR(limit.signal_e(far_m, 0.5 * kPi) / limit.signal_e(far_m, 0.0), 1.0 / kPi, 1e-12);
  EXPECT_NEAR(limit.signal_e(far_m, kPi), 0.0, 1e-12);
  // Near by the mean radiance of its disc, 2/3 of the middle's albedo E / pi, over a pixel.
  const double radiance_w_m2_sr = 2.0 / 3.0 * 0.2 * 623.677 / kPi;
  EXPECT_NEAR(limit.signal_e(1e3, 0.0) /
                  (limit.electrons_per_w_m2 * radiance_w_m2_sr * limit.ifov_rad * limit.ifov_rad),
              1.0, 1e-5);
}

TEST(SignalLimit, HasAMarginWhoseSignIsThatOfTheSnr) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> digits(2.0, 9.0);
  std::uniform_real_distribution<double> phase_rad(0.0, kPi);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  SignalLimit limit = paper_camera();
  int seen = 0;
  for (int i = 0; i < 100000; ++i) {
    const double range_m = std::pow(10.0, digits(random));
    const double phase = phase_rad(random);
    const double margin_m = limit.margin_m(range_m, phase);
    const double snr = limit.snr(range_m, phase);
    if (std::abs(snr / limit.least_snr - 1.0) < 1e-9) continue;
    ASSERT_EQ(margin_m > 0.0, snr > limit.least_snr) << range_m << ' ' << phase;
    // And whatever moves less keeps it: along the line, and around, which turns the phase.
    const double way_m = std::abs(margin_m) * 0.999;
    const double along_m = unit(random) * way_m;
    const double turn =
        std::asin(std::min(1.0, std::sqrt(way_m * way_m - along_m * along_m) / range_m));
    const double there = std::abs(phase + (unit(random) > 0.0 ? turn : -turn));
    if (there > kPi || range_m + along_m < 1.0) continue;
    ASSERT_EQ(limit.margin_m(range_m + along_m, there) > 0.0, margin_m > 0.0) << i;
    seen += margin_m > 0.0 ? 1 : 0;
  }
  EXPECT_GT(seen, 10000);
}

}  // namespace
}  // namespace engine
