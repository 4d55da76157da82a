#include "engine/orbit/attitude.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The axis that lies furthest from a line.
Vector3d apart_from(const Vector3d& unit) {
  Eigen::Index smallest = 0;
  unit.cwiseAbs().minCoeff(&smallest);
  return Vector3d::Unit(smallest);
}

/// The paper's R_x, R_y, R_z turn the axes, so they are the transposes of the usual ones.
Matrix3d axes_turned(double angle_rad, const Vector3d& axis) {
  return AngleAxisd(-angle_rad, axis).toRotationMatrix();
}

}  // namespace

EulerOffsets read_offsets(const ConfigTable& table) {
  const Range turn = between(-180.0, 180.0);
  return {table.number_or("pitch_deg", 0.0, turn) * kDegree,
          table.number_or("roll_deg", 0.0, turn) * kDegree,
          table.number_or("yaw_deg", 0.0, turn) * kDegree};
}

bool moves_straight(const OrbitState& state) noexcept {
  constexpr double kStraight = 1e-9;
  const Vector3d& r = state.position.m;
  const Vector3d& v = state.velocity.m_s;
  return !(r.cross(v).norm() > kStraight * r.norm() * v.norm());
}

Rotation<OrbitalFrame, J2000> orbital_frame(const OrbitState& state) noexcept {
  const Vector3d nadir = -state.position.m.normalized();
  const Vector3d normal = moves_straight(state)
                              ? apart_from(nadir).cross(nadir).normalized()
                              : state.position.m.cross(state.velocity.m_s).normalized();
  Rotation<OrbitalFrame, J2000> frame;
  frame.matrix.row(0) = (-normal).cross(nadir);
  frame.matrix.row(1) = -normal;
  frame.matrix.row(2) = nadir;
  return frame;
}

Rotation<BodyFrame, OrbitalFrame> body_offset(const EulerOffsets& offsets) noexcept {
  return {axes_turned(offsets.pitch_rad, Vector3d::UnitY()) *
          axes_turned(offsets.roll_rad, Vector3d::UnitX()) *
          axes_turned(offsets.yaw_rad, Vector3d::UnitZ())};
}

CameraAttitude look_along(const Direction<J2000>& boresight,
                          const Direction<J2000>& axis) noexcept {
  constexpr double kAxisLimit = 1e-9;
  const Vector3d& z = boresight.unit;
  CameraAttitude attitude;
  Vector3d y = axis.unit.cross(z);
  if (y.norm() <= kAxisLimit) {
    attitude.roll_is_fallback = true;
    const Vector3d other = apart_from(z);
    y = other - other.dot(z) * z;
  }
  y.normalize();
  attitude.axes.matrix.row(0) = y.cross(z);
  attitude.axes.matrix.row(1) = y;
  attitude.axes.matrix.row(2) = z;
  return attitude;
}

}  // namespace engine
