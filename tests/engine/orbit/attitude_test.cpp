#include "engine/orbit/attitude.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/scene/camera_geometry.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test_support::Csv;

/// Rows of a rotation are at right angles, of length 1, and right-handed: to a few roundings.
void expect_rotation(const Matrix3d& m) {
  EXPECT_TRUE(m.allFinite());
  EXPECT_LT((m * m.transpose() - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_NEAR(m.determinant(), 1.0, 1e-15);
}

TEST(OrbitalFrame, LooksDownAndAhead) {
  const test_support::Flyby flyby;
  for (int i = 0; i < 100; ++i) {
    const OrbitState s = flyby.camera.at(flyby.at(97.0 * i));
    const Matrix3d axes = orbital_frame(s).matrix;
    expect_rotation(axes);
    EXPECT_NEAR(axes.row(2).dot(s.position.m.normalized()), -1.0, 1e-14);
    EXPECT_GT(axes.row(0).dot(s.velocity.m_s), 0.99 * s.velocity.m_s.norm());
    EXPECT_NEAR(axes.row(1).dot(s.position.m.cross(s.velocity.m_s).normalized()), -1.0, 1e-14);
  }
}

TEST(OrbitalFrame, OfAnEquatorialOrbitIsKnownByHand) {
  OrbitState s;
  s.position.m = {7e6, 0.0, 0.0};
  s.velocity.m_s = {0.0, 7.5e3, 0.0};
  Matrix3d want;  // along track is +y, the orbit's normal +z, nadir -x
  want << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  EXPECT_EQ(orbital_frame(s).matrix, want);
}

TEST(OrbitalFrame, OfMotionStraightUpOrDownIsARotationThatStays) {
  for (const Vector3d& up : {Vector3d(1, 0, 0), Vector3d(0, 0, -1), Vector3d(0.3, -0.5, 0.8)}) {
    Matrix3d before = Matrix3d::Zero();
    for (const double speed_m_s : {5e3, 1.0, 0.0, -1.0, -5e3}) {
      const OrbitState s{{8e6 * up.normalized()}, {speed_m_s * up.normalized()}};
      const Matrix3d axes = orbital_frame(s).matrix;
      expect_rotation(axes);
      EXPECT_TRUE(moves_straight(s));
      EXPECT_LT((axes.row(2).transpose() + up.normalized()).norm(), 1e-15);
      if (speed_m_s < 5e3) {
        EXPECT_EQ(axes, before);
      }
      before = axes;
    }
  }
}

Matrix3d r_x(double a) {
  Matrix3d m;
  m << 1, 0, 0, 0, std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a);
  return m;
}
Matrix3d r_y(double a) {
  Matrix3d m;
  m << std::cos(a), 0, -std::sin(a), 0, 1, 0, std::sin(a), 0, std::cos(a);
  return m;
}
Matrix3d r_z(double a) {
  Matrix3d m;
  m << std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, 1;
  return m;
}

TEST(BodyOffset, IsPitchAfterRollAfterYawOfTheAxes) {
  for (const double pitch : {-2.0, 0.0, 0.3}) {
    for (const double roll : {-1.0, 0.0, 0.2}) {
      for (const double yaw : {-3.0, 0.0, 0.1}) {
        const Matrix3d got = body_offset({pitch, roll, yaw}).matrix;
        expect_rotation(got);
        EXPECT_LT((got - r_y(pitch) * r_x(roll) * r_z(yaw)).cwiseAbs().maxCoeff(), 1e-15);
      }
    }
  }
}

TEST(BodyOffset, TurnsTheAxesAndLeavesTheThing) {
  // Yaw turns x towards y: what lay along the old x axis then lies at minus y.
  const Direction<OrbitalFrame> ahead{Vector3d::UnitX()};
  const Vector3d seen = (body_offset({0.0, 0.0, kPi / 2.0}) * ahead).unit;
  EXPECT_LT((seen - Vector3d(0.0, -1.0, 0.0)).norm(), 1e-15);
}

TEST(BodyOffset, LosesOneAngleAtARollOfNinetyDegrees) {
  // There pitch and yaw turn about the same axis: only their sum counts.
  const Matrix3d a = body_offset({0.3, kPi / 2.0, 0.2}).matrix;
  const Matrix3d b = body_offset({0.1, kPi / 2.0, 0.4}).matrix;
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(LookAlong, PutsPointsWhereEquations8And9Do) {
  const Csv reference("projection_test_vectors.csv");
  const CameraGeometry camera;
  ASSERT_EQ(camera.principal_point().u, 512.0);
  ASSERT_EQ(camera.principal_point().v, 512.0);
  for (const Csv::Row& row : reference.rows()) {
    const auto metres = [&](const char* x, const char* y, const char* z) {
      return Vector3d(1e3 * Vector3d(row.number(x), row.number(y), row.number(z)));
    };
    const Vector3d line_m =
        metres("ro_x_km", "ro_y_km", "ro_z_km") - metres("rc_x_km", "rc_y_km", "rc_z_km");
    const Vector3d offset_m = metres("off_x_km", "off_y_km", "off_z_km");
    const CameraAttitude attitude = look_along(direction_of<J2000>(line_m));
    EXPECT_FALSE(attitude.roll_is_fallback);
    expect_rotation(attitude.axes.matrix);
    const Vector3d seen_m = attitude.axes.matrix * (line_m + offset_m);
    // A range of 9e6 m resolves 2e-9 m; the places are printed to 1e-6 m, which turns an offset of
    // 10 m by 2e-11 rad at 70 km.
    EXPECT_NEAR(seen_m.x(), 1e3 * row.number("cam_x_km"), 1e-8);
    EXPECT_NEAR(seen_m.y(), 1e3 * row.number("cam_y_km"), 1e-8);
    EXPECT_NEAR(seen_m.z(), 1e3 * row.number("cam_z_km"), 2e-6);
    const auto pixel = camera.project(seen_m);
    ASSERT_TRUE(pixel.has_value());
    // 1e-8 m at 58 km, and nine decimals in print.
    EXPECT_NEAR(pixel->u, row.number("u_px"), 1e-7);
    EXPECT_NEAR(pixel->v, row.number("v_px"), 1e-7);
  }
}

TEST(LookAlong, HoldsDownAtRightAnglesToTheEarthsAxis) {
  for (const Vector3d& v : {Vector3d(1, 2, 3), Vector3d(-1, 0, 0), Vector3d(-1, -0.0, 0),
                            Vector3d(0, -1, 5), Vector3d(1e-6, 0, 1)}) {
    const CameraAttitude attitude = look_along(direction_of<J2000>(v));
    expect_rotation(attitude.axes.matrix);
    EXPECT_FALSE(attitude.roll_is_fallback);
    EXPECT_EQ(attitude.axes.matrix(1, 2), 0.0);
    EXPECT_LT((attitude.axes.matrix.row(2).transpose() - v.normalized()).norm(), 1e-15);
  }
}

TEST(LookAlong, HasNoSeamAlongTheNegativeXAxis) {
  // The printed arccos and sign give 0 here in place of pi.
  const Matrix3d above = look_along(direction_of<J2000>({-1.0, 1e-12, 0.0})).axes.matrix;
  const Matrix3d below = look_along(direction_of<J2000>({-1.0, -1e-12, 0.0})).axes.matrix;
  const Matrix3d on = look_along(direction_of<J2000>({-1.0, 0.0, 0.0})).axes.matrix;
  EXPECT_LT((above - below).cwiseAbs().maxCoeff(), 3e-12);
  EXPECT_LT((above - on).cwiseAbs().maxCoeff(), 3e-12);
  // A half turn about the pole from looking along +x.
  const Matrix3d ahead = look_along(direction_of<J2000>({1.0, 0.0, 0.0})).axes.matrix;
  EXPECT_LT((on - ahead * r_z(kPi)).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(LookAlong, FallsBackAtThePolesAndSaysSo) {
  for (const double z : {1.0, -1.0}) {
    for (const double x : {0.0, 1e-12}) {
      const CameraAttitude attitude = look_along(direction_of<J2000>({x, 0.0, z}));
      EXPECT_TRUE(attitude.roll_is_fallback);
      EXPECT_TRUE(attitude.axes.matrix.allFinite());
      // Within 1e-9 rad of the pole the axes are as far off right angles at most.
      EXPECT_NEAR(attitude.axes.matrix.determinant(), 1.0, 1e-9);
      EXPECT_LT((attitude.axes.matrix * attitude.axes.matrix.transpose() - Matrix3d::Identity())
                    .cwiseAbs()
                    .maxCoeff(),
                1e-9);
    }
  }
}

TEST(LookAlong, HoldsDownAtRightAnglesToAnyAxis) {
  const Direction<J2000> axis = direction_of<J2000>({1.0, -2.0, 0.5});
  for (const Vector3d& v : {Vector3d(1, 2, 3), Vector3d(0, 0, 1), Vector3d(-1, 0, 0)}) {
    const CameraAttitude attitude = look_along(direction_of<J2000>(v), axis);
    expect_rotation(attitude.axes.matrix);
    EXPECT_FALSE(attitude.roll_is_fallback);
    EXPECT_NEAR(attitude.axes.matrix.row(1).dot(axis.unit), 0.0, 1e-15);
    EXPECT_LT(attitude.axes.matrix.row(0).dot(axis.unit), 0.0);  // x grows away from it
  }
  EXPECT_TRUE(look_along(axis, axis).roll_is_fallback);
  EXPECT_TRUE(look_along({-axis.unit}, axis).roll_is_fallback);
}

TEST(ReadOffsets, TakesDegreesOfAHalfTurnEachWay) {
  const ConfigReader config = ConfigReader::from_text("[t]\npitch_deg = 90\nyaw_deg = -180\n", "x");
  const EulerOffsets offsets = read_offsets(config.table("t"));
  EXPECT_DOUBLE_EQ(offsets.pitch_rad, kPi / 2.0);
  EXPECT_DOUBLE_EQ(offsets.roll_rad, 0.0);
  EXPECT_DOUBLE_EQ(offsets.yaw_rad, -kPi);
  const ConfigReader wrong = ConfigReader::from_text("[t]\nroll_deg = 181\n", "x");
  EXPECT_THROW(static_cast<void>(read_offsets(wrong.table("t"))), ConfigError);
}

}  // namespace
}  // namespace engine
