#include "hil/attitude_sensors.h"

#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "hil/turn.h"

namespace hil {

using Eigen::Vector3d;
using engine::kDegree;

SensorSpec read_sensors(const engine::ConfigTable& table) {
  constexpr double kArcsecond = kDegree / 3600.0;
  const engine::Range arcseconds = engine::between(0.0, 3600.0);
  SensorSpec spec;
  spec.across_rad = table.number_or("star_tracker_across_arcsec", 0.0, arcseconds) * kArcsecond;
  spec.roll_rad = table.number_or("star_tracker_roll_arcsec", 0.0, arcseconds) * kArcsecond;
  // Degrees per root hour: 60 root seconds are one root hour.
  spec.gyro_noise_rad_rt_s =
      table.number_or("gyro_noise_deg_rt_h", 0.0, engine::between(0.0, 100.0)) * kDegree / 60.0;
  spec.gyro_interval_s =
      table.number_or("gyro_interval_ms", 10.0, engine::between(0.01, 1e4)) * 1e-3;
  spec.gyro_bias_rad_s =
      table.number_or("gyro_bias_deg_h", 0.0, engine::between(-1e4, 1e4)) * kDegree / 3600.0;
  return spec;
}

MeasuredAttitude AttitudeSensors::read(const Eigen::Matrix3d& axes, const Vector3d& rate_rad_s,
                                       engine::SimTime t) const noexcept {
  engine::Draws draws(seed_, engine::Stream::kAttitude,
                      static_cast<std::uint64_t>(t.time_since_epoch().count()), 0);
  const auto normal = [&draws] { return static_cast<double>(draws.normal()); };
  const double turn_x = spec_.across_rad * normal();
  const double turn_y = spec_.across_rad * normal();
  const double turn_z = spec_.roll_rad * normal();
  const double rate_noise_rad_s = spec_.gyro_noise_rad_rt_s / std::sqrt(spec_.gyro_interval_s);
  MeasuredAttitude measured;
  measured.j2000_to_camera = quaternion_of(axes_turned({turn_x, turn_y, turn_z}) * axes);
  for (std::size_t i = 0; i < 3; ++i) {
    measured.rate_rad_s[i] = rate_rad_s[static_cast<Eigen::Index>(i)] + spec_.gyro_bias_rad_s +
                             rate_noise_rad_s * normal();
  }
  return measured;
}

}  // namespace hil
