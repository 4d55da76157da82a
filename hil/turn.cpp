#include "hil/turn.h"

#include <cmath>

#include "engine/core/constants.h"

namespace hil {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Matrix3d axes_turned(const Vector3d& turn_rad) noexcept {
  const double angle = turn_rad.norm();
  if (!(angle > 0.0)) return Matrix3d::Identity();
  return Eigen::AngleAxisd(-angle, turn_rad / angle).toRotationMatrix();
}

Vector3d turn_of(const Matrix3d& matrix) noexcept {
  // Half angles keep their digits near pi, where the trace does not.
  Quaterniond q(Matrix3d(matrix.transpose()));
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  constexpr double kTiny = 1e-100;
  const double scale = sine > kTiny ? 2.0 * std::atan2(sine, q.w()) / sine : 2.0;
  return scale * q.vec();
}

Vector3d turn_near(const Vector3d& turn_rad, const Vector3d& near_rad) noexcept {
  const double angle = turn_rad.norm();
  if (!(angle > 0.0)) return turn_rad;
  const Vector3d axis = turn_rad / angle;
  const double turns = std::round((near_rad.dot(axis) - angle) / (2.0 * engine::kPi));
  return turn_rad + 2.0 * engine::kPi * turns * axis;
}

Quaternion quaternion_of(const Matrix3d& axes) noexcept {
  const Quaterniond q(axes);
  return {q.w(), q.x(), q.y(), q.z()};
}

Matrix3d axes_of(const Quaternion& q) noexcept {
  return Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

}  // namespace hil
