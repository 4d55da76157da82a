#include "engine/orbit/sight_line.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/sun.h"
#include "engine/scene/camera_geometry.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;
using test_support::Flyby;
using test_support::kClosestOfPass3_s;

const double kPixelsPerRadian = CameraGeometry{}.pixels_per_radian();

/// The direction of light in the frame of an observer who moves with `beta` = v/c: Lorentz's
/// transform of a null vector.
Vector3d aberrated(const Vector3d& toward, const Vector3d& beta) {
  const double gamma = 1.0 / std::sqrt(1.0 - beta.squaredNorm());
  const double along = toward.dot(beta);
  return (toward / gamma + (1.0 + along * gamma / (1.0 + gamma)) * beta).normalized();
}

TEST(SightLine, GeometricIsTheLineBetweenTwoPlacesAtOneInstant) {
  const Flyby flyby;
  for (const double t_s : {0.0, kClosestOfPass3_s, 1e6}) {
    const Epoch now = flyby.at(t_s);
    const SightLine line = sight_line(flyby.camera, flyby.target, now, LightPath::kGeometric);
    const Vector3d want_m = flyby.target.at(now).position.m - flyby.camera.at(now).position.m;
    EXPECT_EQ(line.emitted, now);
    EXPECT_EQ(line.range_m, want_m.norm());
    EXPECT_LT((line.toward_target.unit - want_m.normalized()).norm(), 1e-15);
    EXPECT_EQ(line.apparent.unit, line.toward_target.unit);
  }
}

TEST(SightLine, LightLeavesTheTargetOneRangeOverCEarlier) {
  const Flyby flyby;
  for (const double t_s : {0.0, kClosestOfPass3_s - 15.0, kClosestOfPass3_s, 1e6}) {
    const Epoch now = flyby.at(t_s);
    const SightLine line = sight_line(flyby.camera, flyby.target, now, LightPath::kApparent);
    // The clock counts nanoseconds; two iterations leave (v/c)^2 of the light time, 3 ns far off.
    const double left_s = 30e-3 * 6.5e-10 + 1e-9;
    EXPECT_NEAR(seconds(now - line.emitted), line.range_m / kSpeedOfLight_m_s, left_s) << t_s;
    EXPECT_EQ(line.target.position.m, flyby.target.at(line.emitted).position.m);
    EXPECT_EQ(line.camera.position.m, flyby.camera.at(now).position.m);
  }
}

TEST(SightLine, ApparentAgreesWithLightTimeAndLorentzAberration) {
  const Flyby flyby;
  for (double t_s = kClosestOfPass3_s - 15.0; t_s < kClosestOfPass3_s + 16.0; t_s += 1.0) {
    const Epoch now = flyby.at(t_s);
    const OrbitState camera = flyby.camera.at(now);
    const OrbitState target = flyby.target.at(now);
    // Straight motion over the light time is exact to 1e-8 m: 4.5 m/s^2 times (1 ms)^2.
    double delay_s = 0;
    for (int i = 0; i < 10; ++i) {
      delay_s = (target.position.m - delay_s * target.velocity.m_s - camera.position.m).norm() /
                kSpeedOfLight_m_s;
    }
    const Vector3d light_path =
        (target.position.m - delay_s * target.velocity.m_s - camera.position.m).normalized();
    const Vector3d truth = aberrated(light_path, camera.velocity.m_s / kSpeedOfLight_m_s);
    const SightLine line = sight_line(flyby.camera, flyby.target, now, LightPath::kApparent);
    // The header's promise: 7e-10 rad for the first order of v/c; a nanosecond adds 1e-10 at most.
    EXPECT_LT(angle_between_rad(line.apparent.unit, truth), 8e-10) << t_s;
  }
}

TEST(SightLine, ApparentPlaceIsOffByTheRelativeSpeedOverC) {
  // Light time moves the target back by v_target/c, aberration forward by v_camera/c: together the
  // relative speed across the line over c, 14.544 km/s at the closest approach: 33.587 px.
  // The model's 33.5 px is the same with 14.5 km/s.
  const Flyby flyby;
  const Epoch now = flyby.at(kClosestOfPass3_s);
  const SightLine geometric = sight_line(flyby.camera, flyby.target, now, LightPath::kGeometric);
  const SightLine apparent = sight_line(flyby.camera, flyby.target, now, LightPath::kApparent);
  const double off_px =
      angle_between_rad(apparent.apparent.unit, geometric.apparent.unit) * kPixelsPerRadian;
  const double expected_px = 14.544238e3 / kSpeedOfLight_m_s * kPixelsPerRadian;
  // What is left out is of second order: (5e-5)^2 rad is .002 px.
  EXPECT_NEAR(off_px, expected_px, 0.002);
  EXPECT_NEAR(off_px, 33.5, 0.1);
  const Vector3d shift = apparent.apparent.unit - geometric.apparent.unit;
  const Vector3d relative = geometric.target.velocity.m_s - geometric.camera.velocity.m_s;
  EXPECT_LT(shift.dot(relative), 0.0);  // the target lags behind
}

TEST(SightLine, ATargetMovesAgainstTheStarsBehindItByItsOwnSpeedOverC) {
  // What the camera's speed does to both is the same; what is left is the target's light time, and
  // that stars are seen from an Earth that moves: 30 and 8 km/s.
  const Flyby flyby;
  for (const double t_s : {0.0, kClosestOfPass3_s, 1e6}) {
    const Epoch now = flyby.at(t_s);
    const SightLine geometric = sight_line(flyby.camera, flyby.target, now, LightPath::kGeometric);
    const SightLine apparent = sight_line(flyby.camera, flyby.target, now, LightPath::kApparent);
    const Vector3d star = geometric.toward_target.unit;  // hidden by it, were light infinitely fast
    const Vector3d earth_m_s = earth_velocity(now).m_s;
    const Vector3d seen = engine::aberrated(star, {geometric.camera.velocity.m_s + earth_m_s});
    const Vector3d speed_m_s = geometric.target.velocity.m_s + earth_m_s;
    const Vector3d expected = -(speed_m_s - speed_m_s.dot(star) * star) / kSpeedOfLight_m_s;
    // Of second order, (1.3e-4)^2, .012 px. Far off, the target's orbit bends meanwhile.
    const double bend_rad = 0.5 * 8.7 * geometric.range_m / (kSpeedOfLight_m_s * kSpeedOfLight_m_s);
    EXPECT_LT((apparent.apparent.unit - seen - expected).norm() * kPixelsPerRadian,
              0.012 + bend_rad * kPixelsPerRadian)
        << t_s;
    EXPECT_GT(expected.norm() * kPixelsPerRadian, 20.0);
  }
}

TEST(SightLine, RatesAreThoseOfTheReferencePasses) {
  const Flyby flyby;
  const Csv reference("range_windows_15d.csv");
  for (const Csv::Row& row : reference.rows()) {
    const SightLine line = sight_line(flyby.camera, flyby.target, flyby.at(row.number("tca_s")),
                                      LightPath::kGeometric);
    EXPECT_NEAR(line.range_m, 1e3 * row.number("min_range_km"), 1e-3);
    // Nine significant digits are printed.
    EXPECT_NEAR(line.rate_rad_s / row.number("los_rate_max_rad_s"), 1.0, 1e-8);
    // A microsecond of rounding in the printed time, times v^2/r: 3 m/s^2 per ms.
    EXPECT_NEAR(line.range_rate_m_s, 0.0, 1e-6 * 14.6e3 * 14.6e3 / line.range_m);
  }
}

TEST(SightLine, AberrationCanBeTakenOutAgain) {
  const Flyby flyby;
  const SightLine line =
      sight_line(flyby.camera, flyby.target, flyby.at(kClosestOfPass3_s), LightPath::kApparent);
  const Rotation<J2000, J2000> turn = without_aberration(line);
  EXPECT_LT(((turn * line.apparent).unit - line.toward_target.unit).norm(), 1e-15);
  EXPECT_NEAR(turn.matrix.determinant(), 1.0, 1e-15);
  const SightLine plain =
      sight_line(flyby.camera, flyby.target, flyby.at(kClosestOfPass3_s), LightPath::kGeometric);
  EXPECT_LT((without_aberration(plain).matrix - Eigen::Matrix3d::Identity()).norm(), 1e-15);
}

TEST(SightLine, AStarIsSeenWhereLorentzPutsIt) {
  for (const Vector3d& speed_m_s :
       {Vector3d(0, 0, 0), Vector3d(30e3, 0, 0), Vector3d(-9e3, 2e4, 7e3),
        Vector3d(0, 0, 0.6 * kSpeedOfLight_m_s)}) {
    for (const Vector3d& star : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 0.6, 0.8)}) {
      const Vector3d seen = engine::aberrated(star, Velocity<J2000>{speed_m_s});
      EXPECT_LT((seen - aberrated(star, speed_m_s / kSpeedOfLight_m_s)).norm(), 1e-15);
      EXPECT_NEAR(seen.norm(), 1.0, 1e-15);
    }
  }
}

}  // namespace
}  // namespace engine
