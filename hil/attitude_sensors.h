#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "engine/core/vec.h"
#include "hil/camera_link.h"

namespace hil {

/// What star tracker and gyro add to the truth. Zero: they are exact.
struct SensorSpec {
  double across_rad = 0;           ///< star tracker, 1 sigma, about x and about y each
  double roll_rad = 0;             ///< star tracker, 1 sigma, about the boresight
  double gyro_noise_rad_rt_s = 0;  ///< angular random walk, each axis
  double gyro_interval_s = 0.01;   ///< over which the gyro averages one reading
  double gyro_bias_rad_s = 0;      ///< each axis
};
[[nodiscard]] SensorSpec read_sensors(const engine::ConfigTable& table);

/// A star tracker and a gyro, fixed to the camera and aligned with its axes.
///
/// The star tracker's error is a small turn, normal, new at every instant. A gyro reading is the
/// true rate plus bias plus white noise of N / sqrt(interval), N the angular random walk (IEEE
/// 952-1997, annex C). All errors are functions of seed and time: the same instant asked twice
/// gives the same answer.
/// Leaves out: the sensors' own delay, alignment and scale errors, bias instability, and what the
/// gyro's averaging does to fast vibration.
/// Thread: any. Loop-safe.
class AttitudeSensors {
 public:
  AttitudeSensors(const SensorSpec& spec, std::uint64_t seed) noexcept : spec_(spec), seed_(seed) {}

  [[nodiscard]] MeasuredAttitude read(const Eigen::Matrix3d& axes,
                                      const Eigen::Vector3d& rate_rad_s,
                                      engine::SimTime t) const noexcept;

 private:
  SensorSpec spec_;
  std::uint64_t seed_;
};

}  // namespace hil
