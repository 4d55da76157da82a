#include "hil/scripted_pointing.h"

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"

namespace {

using engine::Epoch;
using engine::KeplerPropagator;
using engine::LightPath;
using engine::sim_time;
using engine::SimTime;
using hil::RollRule;
using hil::ScriptedPointing;

class ScriptedPointingTest : public testing::TestWithParam<RollRule> {
 protected:
  static engine::KeplerElements orbit(double inclination_rad, double mean_anomaly_rad) {
    engine::KeplerElements elements;
    elements.inclination_rad = inclination_rad;
    elements.mean_anomaly_rad = mean_anomaly_rad;
    return elements;
  }
  KeplerPropagator camera_{orbit(1.7, 0.0), Epoch{}};
  KeplerPropagator target_{orbit(0.9, 0.02), Epoch{}};
};

// Axes are unit vectors of doubles: a few roundings of 1e-16.
constexpr double kRounding = 1e-14;

TEST_P(ScriptedPointingTest, LooksAtTheApparentTargetAtTheTimeAskedFor) {
  for (const LightPath path : {LightPath::kApparent, LightPath::kGeometric}) {
    ScriptedPointing pointing(camera_, target_, Epoch{}, path, GetParam());
    for (const double t : {0.0, 10.0, 1000.0}) {
      const auto line =
          engine::sight_line(camera_, target_, Epoch{} + sim_time(t).time_since_epoch(), path);
      const Eigen::Matrix3d axes = pointing.attitude(sim_time(t)).axes.matrix;
      EXPECT_NEAR(axes.row(2).dot(line.apparent.unit), 1.0, kRounding) << t;
      EXPECT_NEAR((axes * axes.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, kRounding);
      EXPECT_NEAR(axes.determinant(), 1.0, kRounding);
    }
  }
}

TEST_P(ScriptedPointingTest, ObeysNobody) {
  ScriptedPointing pointing(camera_, target_, Epoch{}, LightPath::kApparent, GetParam());
  const Eigen::Matrix3d before = pointing.attitude(sim_time(1.0)).axes.matrix;
  hil::Command command;
  command.kind = hil::CommandKind::kTrim;
  command.trim_offset_rad = {1e-3, 1e-3};
  pointing.apply(command);
  EXPECT_EQ(pointing.attitude(sim_time(1.0)).axes.matrix, before);
  EXPECT_EQ(pointing.trim_rad(), hil::TrimAngles{});
}

INSTANTIATE_TEST_SUITE_P(BothRolls, ScriptedPointingTest,
                         testing::Values(RollRule::kCelestial, RollRule::kVertical),
                         [](const auto& roll) {
                           return roll.param == RollRule::kVertical ? "Vertical" : "Celestial";
                         });

TEST_F(ScriptedPointingTest, VerticalRollHoldsTheRowsLevelAndXTowardsTheEarth) {
  ScriptedPointing pointing(camera_, target_, Epoch{}, LightPath::kApparent, RollRule::kVertical);
  for (const double t : {0.0, 500.0, 2000.0}) {
    const Eigen::Vector3d up =
        camera_.at(Epoch{} + sim_time(t).time_since_epoch()).position.m.normalized();
    const Eigen::Matrix3d axes = pointing.attitude(sim_time(t)).axes.matrix;
    EXPECT_NEAR(axes.row(1).dot(up), 0.0, kRounding) << t;
    EXPECT_LT(axes.row(0).dot(up), 0.0) << t;
  }
}

TEST_F(ScriptedPointingTest, CelestialRollHoldsTheColumnsLevelWithTheEquator) {
  ScriptedPointing pointing(camera_, target_, Epoch{}, LightPath::kApparent, RollRule::kCelestial);
  for (const double t : {0.0, 500.0, 2000.0})
    EXPECT_NEAR(pointing.attitude(sim_time(t)).axes.matrix(1, 2), 0.0, kRounding) << t;
}

}  // namespace
