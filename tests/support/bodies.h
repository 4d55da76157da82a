#pragma once

#include <cmath>

#include "engine/orbit/propagator.h"

/// Bodies whose motion a test can write down.
namespace test_support {

/// Stays where it is.
class FixedBody final : public engine::Propagator {
 public:
  explicit FixedBody(const Eigen::Vector3d& m) { state_.position.m = m; }
  [[nodiscard]] engine::OrbitState at(engine::Epoch /*t*/) const noexcept override {
    return state_;
  }

 private:
  engine::OrbitState state_;
};

/// On a circle about the Earth's centre: from `start` on, at `rate` about `normal`.
class CirclingBody final : public engine::Propagator {
 public:
  /// Pre: `normal` is a unit vector perpendicular to `start_m`.
  CirclingBody(const Eigen::Vector3d& start_m, const Eigen::Vector3d& normal, double rate_rad_s)
      : start_m_(start_m), normal_(normal), rate_rad_s_(rate_rad_s) {}
  [[nodiscard]] engine::OrbitState at(engine::Epoch t) const noexcept override {
    const double angle = rate_rad_s_ * engine::seconds(t.time_since_epoch());
    engine::OrbitState state;
    state.position.m = Eigen::AngleAxisd(angle, normal_) * start_m_;
    state.velocity.m_s = rate_rad_s_ * normal_.cross(state.position.m);
    return state;
  }

 private:
  Eigen::Vector3d start_m_;
  Eigen::Vector3d normal_;
  double rate_rad_s_;
};

}  // namespace test_support
