#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

#include "engine/core/constants.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// A lamp as light that can be asked for: a cone of directions of even radiance, or one direction.
/// Leaves out: the darkening of the Sun's limb.
/// Thread: any. Loop-safe.
class LampCone {
 public:
  LampCone() = default;
  /// `half_angle_rad` 0: parallel light.
  LampCone(const Lamp& lamp, double half_angle_rad) noexcept
      : irradiance_w_m2_(lamp.irradiance_w_m2),
        half_angle_rad_(half_angle_rad),
        one_minus_cos_(2.0 * std::pow(std::sin(0.5 * half_angle_rad), 2)),
        axis_(lamp.toward.unit),
        x_(Eigen::Vector3d::UnitX()),
        y_(Eigen::Vector3d::UnitY()) {
    if (one_minus_cos_ <= 0.0) return;
    x_ = axis_.unitOrthogonal();
    y_ = axis_.cross(x_);
  }

  [[nodiscard]] bool parallel() const noexcept { return !(one_minus_cos_ > 0.0); }
  [[nodiscard]] double half_angle_rad() const noexcept { return half_angle_rad_; }
  [[nodiscard]] double one_minus_cos() const noexcept { return one_minus_cos_; }
  [[nodiscard]] const Eigen::Vector3d& axis() const noexcept { return axis_; }
  /// Across the axis and each other.
  [[nodiscard]] const Eigen::Vector3d& side_x() const noexcept { return x_; }
  [[nodiscard]] const Eigen::Vector3d& side_y() const noexcept { return y_; }
  /// Across the beam.
  [[nodiscard]] double irradiance_w_m2() const noexcept { return irradiance_w_m2_; }
  /// Of the lamp's face. Pre: not parallel.
  [[nodiscard]] double radiance_w_m2_sr() const noexcept {
    return irradiance_w_m2_ * density_inside();
  }
  /// Towards a place of the lamp, each as likely per solid angle.
  [[nodiscard]] Eigen::Vector3f sample(const std::array<float, 2>& numbers) const noexcept {
    if (parallel()) return axis_.cast<float>();
    const float drop = static_cast<float>(one_minus_cos_) * numbers[0];
    const float across = std::sqrt(drop * (2.0F - drop));
    const float turn = static_cast<float>(2.0 * kPi) * numbers[1];
    return ((1.0F - drop) * axis_.cast<float>() + across * std::cos(turn) * x_.cast<float>()) +
           across * std::sin(turn) * y_.cast<float>();
  }
  /// Of sample(), per steradian; 0 beside the lamp. Pre: not parallel.
  [[nodiscard]] double density(const Eigen::Vector3d& toward) const noexcept {
    return 0.5 * (toward - axis_).squaredNorm() <= one_minus_cos_ ? density_inside() : 0.0;
  }

 private:
  [[nodiscard]] double density_inside() const noexcept {
    return 1.0 / (2.0 * kPi * one_minus_cos_);
  }

  double irradiance_w_m2_ = 0;
  double half_angle_rad_ = 0;
  double one_minus_cos_ = 0;  ///< of the half angle
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d x_ = Eigen::Vector3d::UnitX();
  Eigen::Vector3d y_ = Eigen::Vector3d::UnitY();
};

inline constexpr std::size_t kLamps = 2;
struct LampCones {
  std::array<LampCone, kLamps> cones;
  const EarthLight* earth = nullptr;  ///< its sunlit cap; none: dark, or one of the cones
  [[nodiscard]] const LampCone& operator[](std::size_t k) const noexcept { return cones[k]; }
};

/// The lamps of a body, in a fixed order.
[[nodiscard]] inline std::array<const Lamp*, kLamps> lamps_of(const BodyView& s) noexcept {
  return {&s.sun, &s.earthshine};
}
/// Earthshine stays one direction: it is a vector irradiance.
[[nodiscard]] inline LampCones lamp_cones(const BodyView& s, double sun_half_angle_rad) noexcept {
  return {{LampCone(s.sun, sun_half_angle_rad), LampCone(s.earthshine, 0.0)}};
}
/// The same, with the sunlit cap itself in place of its vector where the body has it. The view
/// outlives them.
[[nodiscard]] inline LampCones lamps_with_cap(const BodyView& s,
                                              double sun_half_angle_rad) noexcept {
  if (s.earth.dark()) return lamp_cones(s, sun_half_angle_rad);
  return {{LampCone(s.sun, sun_half_angle_rad), LampCone()}, &s.earth};
}

}  // namespace engine
