#include "engine/core/vec.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

TEST(AngleBetween, IsExactFromNoughtToAHalfTurn) {
  for (const double angle :
       {1e-12, 1e-9, 1e-6, 1e-3, 1.0, 2.0, kPi - 1e-3, kPi - 1e-9, kPi - 1e-12}) {
    const Eigen::Vector3d a(7e6, 0, 0);
    const Eigen::Vector3d b(3.0 * std::cos(angle), 3.0 * std::sin(angle), 0);
    // Relative near zero; near pi the angle itself is rounded to 4e-16.
    EXPECT_NEAR(angle_between_rad(a, b), angle, 1e-12 * angle);
    EXPECT_NEAR(kPi - angle_between_rad(a, b), kPi - angle, 1e-15 + 1e-12 * (kPi - angle));
  }
  EXPECT_EQ(angle_between_rad({1, 2, 3}, {1, 2, 3}), 0.0);
}

TEST(Rotation, InverseUndoesIt) {
  const Rotation<CameraFrame, J2000> turn{
      Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix()};
  const Direction<J2000> d = direction_of<J2000>({1, -1, 0.5});
  EXPECT_LT(((turn.inverse() * (turn * d)).unit - d.unit).norm(), 1e-15);
  EXPECT_LT(((turn.inverse() * turn).matrix - Eigen::Matrix3d::Identity()).norm(), 1e-15);
}

}  // namespace
}  // namespace engine
