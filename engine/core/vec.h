#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace engine {

/// The frames. Axes as in orbit/README.md.
struct J2000 {};         ///< Earth's centre, mean equator and equinox of J2000 (taken as GCRS)
struct OrbitalFrame {};  ///< x along track, y minus the orbit normal, z nadir
struct BodyFrame {};     ///< the target's own: +x to the aperture, +z nadir, panels along y
struct CameraFrame {};   ///< x right (u grows), y down (v grows), z boresight
struct EarthFixed {};    ///< Earth's centre, x to Greenwich's meridian, z to the north pole

/// Where something is, in metres.
template <class Frame>
struct Position {
  Eigen::Vector3d m = Eigen::Vector3d::Zero();
};

/// How fast it moves, in m/s.
template <class Frame>
struct Velocity {
  Eigen::Vector3d m_s = Eigen::Vector3d::Zero();
};

/// A unit vector.
template <class Frame>
struct Direction {
  Eigen::Vector3d unit = Eigen::Vector3d::UnitZ();
};

/// Pre: `v` is not zero.
template <class Frame>
[[nodiscard]] Direction<Frame> direction_of(const Eigen::Vector3d& v) noexcept {
  return {v / v.norm()};
}

/// Takes coordinates in `From` to coordinates in `To`. A passive rotation: the thing stays where it
/// is, the axes change. Rows of the matrix are the axes of `To`, written in `From`.
template <class To, class From>
struct Rotation {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();

  [[nodiscard]] Rotation<From, To> inverse() const noexcept { return {matrix.transpose()}; }
  [[nodiscard]] Direction<To> operator*(const Direction<From>& d) const noexcept {
    return {matrix * d.unit};
  }
  [[nodiscard]] Position<To> operator*(const Position<From>& p) const noexcept {
    return {matrix * p.m};
  }
};

template <class To, class Between, class From>
[[nodiscard]] Rotation<To, From> operator*(const Rotation<To, Between>& a,
                                           const Rotation<Between, From>& b) noexcept {
  return {a.matrix * b.matrix};
}

/// The angle between two vectors by atan2: exact near 0 and pi, where an arccosine is not.
[[nodiscard]] inline double angle_between_rad(const Eigen::Vector3d& a,
                                              const Eigen::Vector3d& b) noexcept {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace engine
