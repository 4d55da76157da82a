#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "engine/orbit/taylor_leg.h"

namespace engine {

/// Torque-free motion of a rigid body: Euler's equations.
///
/// The rate repeats itself after a time that the complete elliptic integral gives (Landau &
/// Lifshitz, Mechanics, section 37), after which the body is as it was but for a turn about its
/// angular momentum. One such cycle is integrated by Taylor series, and at() is exact for any
/// number of them. Error: 1e-12 rad a cycle, more where the motion is unstable: a body that turns
/// about its middle axis but for 1e-6 of its rate loses 1e-9 rad a cycle.
class TumblingBody {
 public:
  /// Pre: moments > 0, none above the sum of the others; cycle_steps() <= kMostSteps.
  TumblingBody(const Eigen::Vector3d& inertia, const Eigen::Vector3d& rate_rad_s,
               const Eigen::Quaterniond& j2000_from_body);

  /// How it is turned so long after its start, and its rate in body axes.
  struct Turned {
    Eigen::Quaterniond j2000_from_body;
    Eigen::Vector3d rate_rad_s;
  };
  [[nodiscard]] Turned at(double t_s) const noexcept;
  /// After which the rate is the same again; 0 for a body that turns evenly.
  [[nodiscard]] double cycle_s() const noexcept { return cycle_s_; }

  /// Of an integration's steps an estimate: a body that is almost a ball has cycles without end.
  [[nodiscard]] static double cycle_steps(const Eigen::Vector3d& inertia,
                                          const Eigen::Vector3d& rate_rad_s) noexcept;
  static constexpr double kMostSteps = 2e4;

 private:
  static constexpr std::size_t kOrder = 24;
  using Leg = TaylorLeg<7, kOrder>;  ///< quaternion x, y, z, w and rate

  [[nodiscard]] Leg expand(const Leg::Vector& state) const noexcept;
  [[nodiscard]] static Turned turned(const Leg::Vector& state) noexcept;

  Eigen::Vector3d pull_;  ///< rate' = pull (y z, z x, x y)
  Turned start_;
  double cycle_s_ = 0;
  Eigen::AngleAxisd turn_;  ///< of a cycle, in J2000
  std::vector<double> begins_s_;
  std::vector<Leg> legs_;
};

}  // namespace engine
