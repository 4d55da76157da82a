#include "hil/attitude_sensors.h"

#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "hil/turn.h"
#include "tests/support/statistics.h"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::sim_time;
using hil::AttitudeSensors;
using hil::MeasuredAttitude;
using hil::SensorSpec;
using test_support::Moments;

const Matrix3d kAxes = hil::axes_turned({0.3, -1.1, 0.7});
const Vector3d kRate_rad_s(1e-3, 2e-3, -3e-3);

/// The star tracker's error as a turn of the camera.
Vector3d error_of(const MeasuredAttitude& m) {
  return hil::turn_of(hil::axes_of(m.j2000_to_camera) * kAxes.transpose());
}

TEST(AttitudeSensors, WithoutErrorsSayTheTruth) {
  const MeasuredAttitude m = AttitudeSensors({}, 1).read(kAxes, kRate_rad_s, sim_time(5.0));
  EXPECT_NEAR(error_of(m).norm(), 0.0, 1e-15);
  EXPECT_EQ(m.rate_rad_s, (std::array<double, 3>{1e-3, 2e-3, -3e-3}));
}

TEST(AttitudeSensors, ErrorsHaveTheirSigmasAndNoMean) {
  SensorSpec spec;
  spec.across_rad = 2e-5;
  spec.roll_rad = 1e-4;
  spec.gyro_noise_rad_rt_s = 3e-6;
  spec.gyro_interval_s = 0.04;
  spec.gyro_bias_rad_s = 5e-7;
  const AttitudeSensors sensors(spec, 42);
  constexpr int kReadings = 20'000;
  std::array<Moments, 6> moments;
  for (int i = 0; i < kReadings; ++i) {
    const MeasuredAttitude m = sensors.read(kAxes, kRate_rad_s, sim_time(0.1 * i));
    const Vector3d error = error_of(m);
    for (std::size_t j = 0; j < 3; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      moments[j].add(error[k]);
      moments[j + 3].add(m.rate_rad_s[j] - kRate_rad_s[k]);
    }
  }
  const double rate_sigma = 3e-6 / 0.2;  // N / sqrt(interval)
  const std::array sigmas{2e-5, 2e-5, 1e-4, rate_sigma, rate_sigma, rate_sigma};
  for (std::size_t j = 0; j < 6; ++j) {
    SCOPED_TRACE(j);
    // 5 sigma of a mean, and of a variance: sqrt(2 / n).
    const double bias = j < 3 ? 0.0 : 5e-7;
    EXPECT_NEAR(moments[j].mean(), bias, 5.0 * sigmas[j] / std::sqrt(kReadings));
    EXPECT_NEAR(moments[j].variance() / (sigmas[j] * sigmas[j]), 1.0,
                5.0 * std::sqrt(2.0 / kReadings));
  }
}

TEST(AttitudeSensors, ErrorsOfOneInstantDoNotKnowEachOther) {
  SensorSpec spec;
  spec.across_rad = spec.roll_rad = 1e-4;
  spec.gyro_noise_rad_rt_s = 1e-6;
  const AttitudeSensors sensors(spec, 3);
  constexpr std::size_t kReadings = 10'000;
  std::array<std::vector<double>, 6> errors;
  for (std::size_t i = 0; i < kReadings; ++i) {
    const MeasuredAttitude m =
        sensors.read(kAxes, kRate_rad_s, sim_time(0.1 * static_cast<double>(i)));
    const Vector3d error = error_of(m);
    for (std::size_t j = 0; j < 3; ++j) {
      errors[j].push_back(error[static_cast<Eigen::Index>(j)]);
      errors[j + 3].push_back(m.rate_rad_s[j]);
    }
  }
  for (std::size_t a = 0; a < 6; ++a)
    for (std::size_t b = 0; b < a; ++b)  // 5 sigma of a correlation: 5 / sqrt(n)
      EXPECT_NEAR(test_support::correlation(errors[a], errors[b]), 0.0, 0.05) << a << " " << b;
}

TEST(AttitudeSensors, SeedAndTimeAreAllThatAReadingDependsOn) {
  SensorSpec spec;
  spec.across_rad = 1e-4;
  spec.gyro_noise_rad_rt_s = 1e-6;
  const auto read = [&](std::uint64_t seed, double t) {
    return AttitudeSensors(spec, seed).read(kAxes, kRate_rad_s, sim_time(t));
  };
  const MeasuredAttitude first = read(1, 100.0);
  EXPECT_EQ(first.j2000_to_camera, read(1, 100.0).j2000_to_camera);
  EXPECT_EQ(first.rate_rad_s, read(1, 100.0).rate_rad_s);
  EXPECT_NE(first.j2000_to_camera, read(1, 100.1).j2000_to_camera);
  EXPECT_NE(first.rate_rad_s, read(2, 100.0).rate_rad_s);
}

TEST(AttitudeSensors, ScenarioIsReadInItsUnits) {
  const auto config = engine::ConfigReader::from_text(
      "[sensors]\nstar_tracker_across_arcsec = 3600\nstar_tracker_roll_arcsec = 36\n"
      "gyro_noise_deg_rt_h = 0.6\ngyro_interval_ms = 20\ngyro_bias_deg_h = 1\n",
      "s.toml");
  const SensorSpec spec = hil::read_sensors(config.table("sensors"));
  config.reject_unknown_keys();
  EXPECT_DOUBLE_EQ(spec.across_rad, engine::kDegree);
  EXPECT_DOUBLE_EQ(spec.roll_rad, 0.01 * engine::kDegree);
  EXPECT_DOUBLE_EQ(spec.gyro_noise_rad_rt_s, 0.01 * engine::kDegree);
  EXPECT_DOUBLE_EQ(spec.gyro_interval_s, 0.02);
  EXPECT_DOUBLE_EQ(spec.gyro_bias_rad_s, engine::kDegree / 3600.0);
}

}  // namespace
