#include "hil/closed_loop_pointing.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/scene/camera_geometry.h"
#include "tests/support/bodies.h"

namespace {

using engine::Epoch;
using engine::sim_time;
using engine::SimTime;
using hil::ActuatorSpec;
using hil::ClosedLoopPointing;
using hil::Command;
using hil::CommandKind;
using hil::GuidanceError;
using hil::ScriptedPointing;

const Eigen::Vector3d kCamera_m(7e6, 1e5, -2e5);
const Eigen::Vector3d kLine_m(4e4, -9e4, 3e4);

class ClosedLoopPointingTest : public testing::Test {
 protected:
  [[nodiscard]] ScriptedPointing prediction() const {
    return {camera_, target_, Epoch{}, engine::LightPath::kGeometric, hil::RollRule::kCelestial};
  }
  /// The target's direction in camera axes.
  [[nodiscard]] static Eigen::Vector3d seen(const engine::CameraAttitude& attitude) {
    return attitude.axes.matrix * kLine_m.normalized();
  }

  test_support::FixedBody camera_{kCamera_m};
  test_support::FixedBody target_{kCamera_m + kLine_m};
};

// Directions are unit vectors of doubles, turned by two rotations: a few 1e-16 rad.
constexpr double kRounding_rad = 1e-14;

TEST_F(ClosedLoopPointingTest, WithoutAnErrorItLooksWhereThePredictionLooks) {
  ClosedLoopPointing pointing(prediction(), GuidanceError{}, ActuatorSpec{});
  EXPECT_EQ(pointing.attitude(sim_time(3.0)).axes.matrix,
            prediction().attitude(sim_time(3.0)).axes.matrix);
  EXPECT_NEAR(seen(pointing.attitude(sim_time(3.0))).z(), 1.0, kRounding_rad);
}

TEST_F(ClosedLoopPointingTest, GuidanceErrorTowardsXShowsTheTargetAtSmallerU) {
  GuidanceError error;
  error.offset_rad = {200e-6, 0.0};
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  const Eigen::Vector3d target = seen(pointing.attitude(SimTime{}));
  EXPECT_NEAR(std::atan2(target.x(), target.z()), -200e-6, kRounding_rad);
  EXPECT_NEAR(target.y(), 0.0, kRounding_rad);
  const engine::CameraGeometry camera;
  const auto place = camera.project(target);
  ASSERT_TRUE(place.has_value());
  // 200 urad of 6.5 um / 4.5 m is 138.46 px to the left of the boresight.
  EXPECT_NEAR(place->u, camera.principal_point().u - std::tan(200e-6) * camera.pixels_per_radian(),
              1e-7);
}

TEST_F(ClosedLoopPointingTest, GuidanceErrorTowardsYShowsTheTargetAtSmallerV) {
  GuidanceError error;
  error.offset_rad = {0.0, 300e-6};
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  const Eigen::Vector3d target = seen(pointing.attitude(SimTime{}));
  EXPECT_NEAR(target.x(), 0.0, kRounding_rad);
  EXPECT_NEAR(std::atan2(target.y(), target.z()), -300e-6, kRounding_rad);
}

TEST_F(ClosedLoopPointingTest, ErrorsOfBothAxesAddUpToOneTurnAcrossThem) {
  GuidanceError error;
  error.offset_rad = {3e-3, -4e-3};
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  const Eigen::Matrix3d axes = pointing.attitude(SimTime{}).axes.matrix;
  const Eigen::Vector3d target = axes * kLine_m.normalized();
  EXPECT_NEAR(engine::angle_between_rad(target, Eigen::Vector3d::UnitZ()), 5e-3, kRounding_rad);
  EXPECT_NEAR(target.x() / target.y(), -3.0 / 4.0, 1e-11);  // 1e-14 rad of 4e-3
  EXPECT_NEAR((axes * axes.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, kRounding_rad);
}

TEST_F(ClosedLoopPointingTest, GuidanceErrorGrowsFromItsStart) {
  GuidanceError error;
  error.offset_rad = {100e-6, 0.0};
  error.growth_rad_s = {50e-6, -10e-6};
  error.start = sim_time(1000.0);
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  const Eigen::Vector3d target = seen(pointing.attitude(sim_time(1004.0)));
  // tan(a) = a to a^3 / 3 = 9e-12 here.
  EXPECT_NEAR(target.x() / target.z(), -300e-6, 1e-11);
  EXPECT_NEAR(target.y() / target.z(), 40e-6, 1e-11);
}

TEST_F(ClosedLoopPointingTest, TrimOppositeToTheErrorBringsTheTargetBack) {
  GuidanceError error;
  error.offset_rad = {200e-6, -80e-6};
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  static_cast<void>(pointing.attitude(SimTime{}));
  Command command;
  command.kind = CommandKind::kTrim;
  command.trim_offset_rad = {-200e-6, 80e-6};
  pointing.apply(command);
  // 2 s: exp(-z w t) is under 1e-18.
  const Eigen::Vector3d target = seen(pointing.attitude(sim_time(2.0)));
  EXPECT_NEAR(target.x(), 0.0, kRounding_rad);
  EXPECT_NEAR(target.y(), 0.0, kRounding_rad);
  EXPECT_NEAR(pointing.trim_rad()[0], -200e-6, kRounding_rad);
  EXPECT_NEAR(pointing.trim_rad()[1], 80e-6, kRounding_rad);
}

TEST_F(ClosedLoopPointingTest, TrimOppositeToAGrowingErrorFollowsIt) {
  GuidanceError error;
  error.offset_rad = {20e-6, 0.0};
  error.growth_rad_s = {50e-6, 0.0};
  ClosedLoopPointing pointing(prediction(), error, ActuatorSpec{});
  static_cast<void>(pointing.attitude(SimTime{}));
  Command command;
  command.kind = CommandKind::kTrim;
  command.trim_offset_rad = {-20e-6, 0.0};
  command.trim_rate_rad_s = {-50e-6, 0.0};
  pointing.apply(command);
  // The rate is fed forward, so nothing lags; see Actuator's own test for the 1e-12.
  for (const double t : {3.0, 3.1, 3.2})
    EXPECT_NEAR(seen(pointing.attitude(sim_time(t))).x(), 0.0, 1e-12) << t;
}

TEST_F(ClosedLoopPointingTest, ReportsChangeNothing) {
  GuidanceError error;
  error.offset_rad = {200e-6, 100e-6};
  ClosedLoopPointing untouched(prediction(), error, ActuatorSpec{});
  ClosedLoopPointing reported(prediction(), error, ActuatorSpec{});
  for (int i = 0; i < 20; ++i) {
    Command trim;
    trim.kind = CommandKind::kTrim;
    trim.trim_offset_rad = {-1e-6 * i, 2e-6};
    Command report = trim;
    report.kind = CommandKind::kReport;
    report.trim_offset_rad = {1e-3, 1e-3};
    report.trim_rate_rad_s = {1e-3, 1e-3};
    const SimTime t = sim_time(0.1 * i);
    ASSERT_EQ(untouched.attitude(t).axes.matrix, reported.attitude(t).axes.matrix) << i;
    untouched.apply(trim);
    reported.apply(trim);
    reported.apply(report);
  }
}

TEST_F(ClosedLoopPointingTest, ATrimReplacesTheOneBefore) {
  ClosedLoopPointing pointing(prediction(), GuidanceError{}, ActuatorSpec{});
  static_cast<void>(pointing.attitude(SimTime{}));
  Command command;
  command.kind = CommandKind::kTrim;
  command.trim_offset_rad = {1e-4, 1e-4};
  command.trim_rate_rad_s = {1e-4, 1e-4};
  pointing.apply(command);
  command.trim_offset_rad = {-3e-5, 0.0};
  command.trim_rate_rad_s = {};
  pointing.apply(command);
  static_cast<void>(pointing.attitude(sim_time(3.0)));
  EXPECT_NEAR(pointing.trim_rad()[0], -3e-5, kRounding_rad);
  EXPECT_NEAR(pointing.trim_rad()[1], 0.0, kRounding_rad);
}

TEST_F(ClosedLoopPointingTest, WhatItPassesOnTheWayIsNoneOfTheGyrosBusiness) {
  // A quick vibration: between two neighbouring instants of an exposure it turns faster than over
  // half of one.
  hil::JitterSpec vibration;
  vibration.lines = {{40.0, 20e-6, 0.3, 0.1}};
  const auto make = [&] {
    return ClosedLoopPointing(prediction(), hil::PointingSpec{},
                              hil::Jitter(vibration, 1, SimTime{}));
  };
  ClosedLoopPointing plain = make();
  ClosedLoopPointing passing = make();
  for (int frame = 0; frame < 5; ++frame) {
    const SimTime open = sim_time(0.05 * frame);
    const engine::Duration exposure = std::chrono::milliseconds(10);
    hil::MeasuredAttitude at_middle;
    const engine::AttitudeTrack track =
        hil::track_over(passing, open, exposure, [&] { at_middle = passing.measured(); });
    EXPECT_EQ(plain.attitude(open).axes.matrix, track.open.axes.matrix);
    EXPECT_EQ(plain.attitude(open + exposure / 2).axes.matrix, track.middle.axes.matrix);
    EXPECT_EQ(plain.measured().rate_rad_s, at_middle.rate_rad_s);
    EXPECT_EQ(plain.attitude(open + exposure).axes.matrix, track.close.axes.matrix);
    // A sine of 40 Hz, 20 urad, half-way to the middle.
    const double t_s = 0.05 * frame + 0.0025;
    const Eigen::Vector3d straight = prediction().attitude(sim_time(t_s)).axes.matrix.row(2);
    const Eigen::Vector3d there = track.after(4).axes.matrix * straight;
    EXPECT_NEAR(std::hypot(there.x(), there.y()),
                std::abs(20e-6 * std::sin(2.0 * engine::kPi * 40.0 * t_s + 0.1)), 1e-11);
  }
}

}  // namespace
