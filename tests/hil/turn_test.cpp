#include "hil/turn.h"

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::kPi;
using hil::Quaternion;

// Products of unit vectors of doubles: a few 1e-16 each.
constexpr double kRounding = 1e-14;
const Vector3d kAxis = Vector3d(1.0, -2.0, 3.0).normalized();

TEST(Turn, AxesGoOneWaySoCoordinatesGoTheOther) {
  // A camera that pans from z towards x by 10 mrad sees what was ahead at -x.
  const Vector3d ahead = hil::axes_turned({0.0, 10e-3, 0.0}) * Vector3d::UnitZ();
  EXPECT_NEAR(ahead.x(), -std::sin(10e-3), kRounding);
  EXPECT_NEAR(ahead.y(), 0.0, kRounding);
}

TEST(Turn, IsFoundAgainInItsMatrix) {
  for (const double angle : {0.0, 1e-12, 1e-6, 0.3, 1.5, 3.0, kPi - 1e-6}) {
    const Vector3d turn = angle * kAxis;
    EXPECT_NEAR((hil::turn_of(hil::axes_turned(turn)) - turn).norm(), 0.0, kRounding) << angle;
  }
}

TEST(Turn, HalfATurnIsFoundOneWayOrTheOther) {
  const Vector3d turn = hil::turn_of(hil::axes_turned(kPi * kAxis));
  EXPECT_NEAR(turn.norm(), kPi, kRounding);
  EXPECT_NEAR(turn.cross(kAxis).norm(), 0.0, kRounding);
}

TEST(Turn, NearAnotherIsTheSameAttitude) {
  const Vector3d near = 3.3 * kAxis;
  const Vector3d found = hil::turn_of(hil::axes_turned(near));
  EXPECT_NEAR(found.norm(), 2.0 * kPi - 3.3, kRounding);
  EXPECT_NEAR((hil::turn_near(found, near) - near).norm(), 0.0, kRounding);
  EXPECT_EQ(hil::turn_near(Vector3d::Zero(), near), Vector3d::Zero());
}

TEST(Turn, QuaternionTakesJ2000CoordinatesToCameraCoordinates) {
  // The camera looks along J2000's x; its own x is J2000's y: coordinates go round.
  Matrix3d axes;
  axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  const Quaternion q = hil::quaternion_of(axes);
  const Eigen::Quaterniond eigen(q[0], q[1], q[2], q[3]);
  EXPECT_NEAR((eigen * Vector3d(1.0, 2.0, 3.0) - Vector3d(2.0, 3.0, 1.0)).norm(), 0.0, kRounding);
  EXPECT_NEAR((hil::axes_of(q) - axes).norm(), 0.0, kRounding);
  // A third of a turn about -(1, 1, 1): w = cos 60 deg.
  EXPECT_NEAR(std::abs(q[0]), 0.5, kRounding);
}

TEST(Turn, QuaternionOfAnotherLengthCountsAsOne) {
  EXPECT_NEAR((hil::axes_of({1.2, 0, 0, 0}) - Matrix3d::Identity()).norm(), 0.0, kRounding);
}

}  // namespace
