#include "engine/orbit/held_offset.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;

TEST(HeldOffset, LiesAboveAheadAndToTheSideOfTheOrbitsNormal) {
  const Flyby flyby;
  for (double t_s = 0.0; t_s < 6000.0; t_s += 700.0) {
    const Epoch t = flyby.at(t_s);
    const OrbitState leader = flyby.target.at(t);
    const Vector3d up = leader.position.m.normalized();
    const Vector3d normal = leader.position.m.cross(leader.velocity.m_s).normalized();
    const Vector3d ahead = normal.cross(up);
    const auto beside = [&](const OrbitalOffset& offset) -> Vector3d {
      return HeldOffset(flyby.target, offset).at(t).position.m - leader.position.m;
    };
    // Roundings of 7e6 m.
    EXPECT_LT((beside({30.0, 0, 0}) - 30.0 * up).norm(), 1e-8);
    EXPECT_LT((beside({0, 20.0, 0}) - 20.0 * ahead).norm(), 1e-8);
    EXPECT_LT((beside({0, 0, -10.0}) + 10.0 * normal).norm(), 1e-8);
    EXPECT_GT(beside({0, 1.0, 0}).dot(leader.velocity.m_s), 0.0);
  }
}

TEST(HeldOffset, VelocityIsHowItsPlaceMoves) {
  const Flyby flyby;
  const HeldOffset held(flyby.target, {300.0, -2000.0, 700.0});
  const double step_s = 0.5;
  for (double t_s = 0.0; t_s < 6000.0; t_s += 700.0) {
    const Vector3d moved =
        held.at(flyby.at(t_s + step_s)).position.m - held.at(flyby.at(t_s - step_s)).position.m;
    const Vector3d leader = flyby.target.at(flyby.at(t_s + step_s)).position.m -
                            flyby.target.at(flyby.at(t_s - step_s)).position.m;
    const Vector3d want =
        held.at(flyby.at(t_s)).velocity.m_s - flyby.target.at(flyby.at(t_s)).velocity.m_s;
    // Of 2.4 m/s; the third derivative is 3e-6 m/s^3, and a place is rounded to 1e-9 m.
    EXPECT_GT(want.norm(), 1.0);
    EXPECT_LT(((moved - leader) / (2.0 * step_s) - want).norm(), 1e-6) << t_s;
  }
}

}  // namespace
}  // namespace engine
