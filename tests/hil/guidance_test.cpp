#include "hil/guidance.h"

#include <gtest/gtest.h>

#include "hil/turn.h"
#include "tests/support/bodies.h"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::Epoch;
using engine::from_seconds;
using engine::sim_time;
using hil::BelievedTarget;
using hil::Guidance;
using hil::GuidanceMode;
using hil::TargetKnowledge;
using test_support::CirclingBody;
using test_support::FixedBody;

// Unit vectors of doubles, through a few rotations.
constexpr double kRounding = 1e-14;
constexpr double kRadius_m = 7e6;
constexpr double kRate_rad_s = 1.1e-3;

/// Over the equator, eastward: along +y, normal +z, radial +x at first.
CirclingBody equatorial() { return {Vector3d(kRadius_m, 0, 0), Vector3d::UnitZ(), kRate_rad_s}; }

TEST(BelievedTarget, ErrorsAreAlongTheTrackTheNormalAndTheRadius) {
  const CirclingBody target = equatorial();
  const auto error_m = [&](const TargetKnowledge& error) -> Vector3d {
    return BelievedTarget(target, error).at(Epoch{}).position.m - target.at(Epoch{}).position.m;
  };
  // Positions of 7e6 m are rounded to 1e-9 m.
  EXPECT_NEAR((error_m({.along_m = 100}) - Vector3d(0, 100, 0)).norm(), 0.0, 1e-8);
  EXPECT_NEAR((error_m({.cross_m = 100}) - Vector3d(0, 0, 100)).norm(), 0.0, 1e-8);
  EXPECT_NEAR((error_m({.radial_m = 100}) - Vector3d(100, 0, 0)).norm(), 0.0, 1e-8);
}

TEST(BelievedTarget, ATimingErrorPutsItAheadOnItsOrbit) {
  const CirclingBody target = equatorial();
  const BelievedTarget believed(target, {.ahead_s = 2.5});
  const Epoch t{from_seconds(400.0)};
  EXPECT_EQ(believed.at(t).position.m, target.at(t + from_seconds(2.5)).position.m);
  EXPECT_EQ(believed.at(t).velocity.m_s, target.at(t + from_seconds(2.5)).velocity.m_s);
}

TEST(BelievedTarget, WithoutAnErrorIsTheTargetToTheBit) {
  const CirclingBody target = equatorial();
  const Epoch t{from_seconds(123.456)};
  EXPECT_EQ(BelievedTarget(target, {}).at(t).position.m, target.at(t).position.m);
}

class GuidanceTest : public testing::Test {
 protected:
  [[nodiscard]] Guidance guidance(const hil::GuidanceError& error = {}) const {
    return {hil::ScriptedPointing(camera_, target_, Epoch{}, engine::LightPath::kGeometric,
                                  hil::RollRule::kVertical),
            error};
  }
  CirclingBody camera_ = equatorial();
  FixedBody target_{Vector3d(5e6, 5e6, 1e6)};
};

TEST_F(GuidanceTest, NadirLooksAtTheEarthsCentreAndXAlongTheTrack) {
  Guidance g = guidance();
  g.set_mode(GuidanceMode::kNadir, Matrix3d::Identity());
  for (const double t : {0.0, 700.0, 3000.0}) {
    const Matrix3d axes = g.line(sim_time(t)).axes.matrix;
    const engine::OrbitState camera = camera_.at(Epoch{from_seconds(t)});
    EXPECT_NEAR((axes * -camera.position.m.normalized() - Vector3d::UnitZ()).norm(), 0, kRounding);
    EXPECT_NEAR((axes * camera.velocity.m_s.normalized() - Vector3d::UnitX()).norm(), 0, kRounding);
  }
}

TEST_F(GuidanceTest, PredictedLooksAtTheTarget) {
  Guidance g = guidance();
  const Matrix3d axes = g.line(sim_time(50.0)).axes.matrix;
  const Vector3d to_target =
      target_.at(Epoch{}).position.m - camera_.at(Epoch{from_seconds(50.0)}).position.m;
  EXPECT_NEAR((axes * to_target.normalized() - Vector3d::UnitZ()).norm(), 0.0, kRounding);
}

TEST_F(GuidanceTest, InertialStaysWhereItWasHeld) {
  Guidance g = guidance();
  const Matrix3d held = hil::axes_turned({0.1, -0.7, 2.0});
  g.set_mode(GuidanceMode::kInertial, held);
  for (const double t : {0.0, 5000.0})
    EXPECT_NEAR((g.line(sim_time(t)).axes.matrix - held).norm(), 0.0, kRounding);
}

TEST_F(GuidanceTest, CommandedTurnsFromItsReferenceAtItsRate) {
  Guidance g = guidance();
  hil::MeasuredAttitude attitude;
  const Matrix3d at_reference = hil::axes_turned({0.4, 0.5, -0.6});
  attitude.j2000_to_camera = hil::quaternion_of(at_reference);
  attitude.rate_rad_s = {1e-3, -2e-3, 3e-3};
  g.command(attitude, sim_time(100.0));
  EXPECT_EQ(g.mode(), GuidanceMode::kCommanded);
  for (const double after : {-50.0, 0.0, 20.0}) {
    const Matrix3d wanted = hil::axes_turned(after * Vector3d(1e-3, -2e-3, 3e-3)) * at_reference;
    EXPECT_NEAR((g.line(sim_time(100.0 + after)).axes.matrix - wanted).norm(), 0.0, kRounding);
  }
}

TEST_F(GuidanceTest, CommandedHoldsUntilSomebodyCommands) {
  Guidance g = guidance();
  const Matrix3d held = hil::axes_turned({1.0, 0.0, 0.5});
  g.set_mode(GuidanceMode::kCommanded, held);
  EXPECT_NEAR((g.line(sim_time(9.0)).axes.matrix - held).norm(), 0.0, kRounding);
}

TEST_F(GuidanceTest, CommandedComesBackToTheLastAttitudeCommand) {
  Guidance g = guidance();
  hil::MeasuredAttitude attitude;
  attitude.j2000_to_camera = {0, 1, 0, 0};
  g.command(attitude, sim_time(1.0));
  g.set_mode(GuidanceMode::kNadir, Matrix3d::Identity());
  g.set_mode(GuidanceMode::kCommanded, Matrix3d::Identity());
  EXPECT_NEAR((g.line(sim_time(2.0)).axes.matrix - hil::axes_of({0, 1, 0, 0})).norm(), 0.0,
              kRounding);
}

TEST_F(GuidanceTest, ScenarioIsReadInItsUnits) {
  const auto config = engine::ConfigReader::from_text(
      "[guidance]\nmode = \"nadir\"\ntarget_error_along_m = 10\ntarget_error_cross_m = -20\n"
      "target_error_radial_m = 30\ntarget_error_s = 0.25\n",
      "g.toml");
  const engine::ConfigTable table = config.table("guidance");
  EXPECT_EQ(hil::read_guidance_mode(table), GuidanceMode::kNadir);
  const TargetKnowledge knowledge = hil::read_target_knowledge(table);
  config.reject_unknown_keys();
  EXPECT_EQ(knowledge.along_m, 10.0);
  EXPECT_EQ(knowledge.cross_m, -20.0);
  EXPECT_EQ(knowledge.radial_m, 30.0);
  EXPECT_EQ(knowledge.ahead_s, 0.25);
}

TEST_F(GuidanceTest, AnUnknownModeIsRefusedWithItsLine) {
  const auto config =
      engine::ConfigReader::from_text("[guidance]\nmode = \"sideways\"\n", "g.toml");
  try {
    static_cast<void>(hil::read_guidance_mode(config.table("guidance")));
    FAIL();
  } catch (const engine::ConfigError& e) {
    EXPECT_STREQ(e.what(),
                 "g.toml:2: guidance.mode must be one of \"predicted-target\", \"nadir\", "
                 "\"inertial\", \"commanded\", got \"sideways\"");
  }
}

}  // namespace
