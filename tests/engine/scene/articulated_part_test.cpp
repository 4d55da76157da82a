#include "engine/scene/articulated_part.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "engine/orbit/held_offset.h"
#include "engine/scene/snapshot_builder.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;
using test_support::kClosestOfPass3_s;

std::vector<PartSpec> parts_of(const std::string& text) {
  const ConfigReader config = ConfigReader::from_text(text, "x.toml");
  std::vector<PartSpec> parts = read_parts(config, read_companions(config));
  static_cast<void>(read_attitude(config.table("target")));
  config.reject_unknown_keys();
  return parts;
}

std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(parts_of(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

PartSpec panel() {
  PartSpec spec;
  spec.follows = PartFollows::kSun;
  return spec;
}

/// The front as it stands, in the body's axes.
Vector3d front_of(const PartSpec& spec, const PartPose& pose) {
  return pose.from_owner.transpose() * spec.front;
}

const std::vector<Vector3d>& directions_all_round() {
  static const std::vector<Vector3d> all = [] {
    std::vector<Vector3d> directions;
    // A spiral whose places are evenly spread (golden angle).
    for (int i = 0; i < 500; ++i) {
      const double z = 1.0 - (2.0 * i + 1.0) / 500.0;
      const double turn = 2.399963229728653 * i;
      const double across = std::sqrt(1.0 - z * z);
      directions.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
    }
    return directions;
  }();
  return all;
}

TEST(ArticulatedPart, IsReadWithItsAxesAndWhatItFollows) {
  const auto parts = parts_of(
      "[companions.relay]\nalong_m = 50\n[companions.relay.parts.dish]\ngroups = \"dish\"\n"
      "axis = [0, 0, 2]\nfollows = \"target\"\nfront = [1, 0, 0]\nsecond_axis = [0, 1, 0]\n"
      "second_range_deg = [-10, 20]\n"
      "[target.parts.wing]\ngroups = [\"left\", \"right\"]\nhinge_m = [0.4, 0, 1]\n"
      "axis = [0, 1, 0]\nfollows = \"sun\"\nfront = [0, 0, -1]\nrange_deg = [-90, 90]\n"
      "[target.parts.flag]\ngroups = \"flag\"\naxis = [0, 0, 1]\nangle_deg = 30\n"
      "rate_deg_s = 6\n");
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].name, "flag");
  EXPECT_EQ(parts[0].follows, PartFollows::kNothing);
  EXPECT_DOUBLE_EQ(parts[0].rate_rad_s, 6.0 * kDegree);
  EXPECT_EQ(parts[1].groups, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(parts[1].hinge_m, Vector3d(0.4, 0, 1));
  EXPECT_DOUBLE_EQ(parts[1].limits_rad.value()[0], -0.5 * kPi);
  EXPECT_EQ(parts[2].owner, 1U);
  EXPECT_EQ(parts[2].follows, PartFollows::kBody);
  EXPECT_EQ(parts[2].followed, 0U);
  EXPECT_EQ(parts[2].axis, Vector3d::UnitZ());
  EXPECT_DOUBLE_EQ(parts[2].second_limits_rad.value()[1], 20.0 * kDegree);
}

TEST(ArticulatedPart, WhatIsWrongIsToldWithItsLine) {
  const std::string wing = "[target.parts.wing]\ngroups = \"wing\"\n";
  const std::string sun = "follows = \"sun\"\n";
  const auto expect = [](const std::string& text, const std::string& complaint) {
    EXPECT_EQ(complaint_of(text), "x.toml:" + complaint);
  };
  expect("[target.parts.wing]\naxis = [0, 1, 0]\n",
         "1: target.parts.wing must have groups: names of groups of the mesh");
  expect(wing + "axis = [0, 0, 0]\n",
         "3: target.parts.wing.axis must have a direction, got [0, 0, 0]");
  expect(wing + "axis = [0, 1, 0]\nfollows = \"moon\"\nfront = [0, 0, 1]\n",
         "4: target.parts.wing.follows must be \"sun\", \"earth\", \"camera\", \"target\" or the "
         "name of a companion, got \"moon\"");
  expect(wing + "axis = [0, 1, 0]\nfollows = \"target\"\nfront = [0, 0, 1]\n",
         "4: target.parts.wing.follows must be another body than its own, got \"target\"");
  expect(wing + "axis = [0, 1, 0]\n" + sun + "front = [0, -3, 0]\n",
         "5: target.parts.wing.front must not lie along the axis: no turn would change where it "
         "points");
  expect(wing + "axis = [0, 1, 0]\n" + sun + "front = [1, 0, 0]\nsecond_axis = [1, 1, 0]\n",
         "6: target.parts.wing.second_axis must be at right angles to axis");
  expect(wing + "axis = [0, 1, 0]\n" + sun + "front = [1, 0, 0]\nsecond_axis = [1, 0, 0]\n",
         "6: target.parts.wing.second_axis must be at right angles to front");
  expect(wing + "axis = [0, 1, 0]\nsecond_axis = [1, 0, 0]\n",
         "4: target.parts.wing.second_axis needs follows: what the part is to point at");
  expect(wing + "axis = [0, 1, 0]\nrange_deg = [20, 10]\n",
         "4: target.parts.wing.range_deg must be [least, most], a whole turn apart at most");
  // A rate is for what follows nothing.
  EXPECT_NE(complaint_of(wing + "axis = [0, 1, 0]\n" + sun + "front = [1, 0, 0]\nrate_deg_s = 1\n"),
            "");
}

TEST(ArticulatedPart, OneAxisBringsTheFrontAsNearAsAnyTurnDoes) {
  PartSpec spec = panel();
  spec.axis = Vector3d(0.3, 1.0, -0.2).normalized();
  spec.front = Vector3d(0.5, 0.2, 1.0).normalized();
  const ArticulatedPart part(spec);
  for (const Vector3d& toward : directions_all_round()) {
    const PartPose pose = part.pose(7e6 * toward, {});
    double best = -1.0;
    for (int i = 0; i < 3600; ++i) {
      const Vector3d turned = Eigen::AngleAxisd(i * 0.1 * kDegree, spec.axis) * spec.front;
      best = std::max(best, turned.dot(toward));
    }
    // Half a step of the search is worth 4e-7 of a cosine.
    EXPECT_GE(front_of(spec, pose).dot(toward), best - 1e-12);
    EXPECT_LE(front_of(spec, pose).dot(toward), best + 4e-7);
    EXPECT_LT((pose.from_owner * spec.axis - spec.axis).norm(), 1e-14);
    EXPECT_FALSE(pose.at_limit);
  }
}

TEST(ArticulatedPart, TwoAxesPointTheFrontExactly) {
  // At rest across the first axis, aslant to it, along it, and to the other side.
  for (const Vector3d& front :
       {Vector3d(1, 0, 0), Vector3d(-1, 0, 0.7), Vector3d(0, 0, 1), Vector3d(1, 0, -5)}) {
    PartSpec spec = panel();
    spec.axis = Vector3d::UnitZ();
    spec.second_axis = Vector3d::UnitY();
    spec.front = front.normalized();
    const ArticulatedPart part(spec);
    for (Vector3d toward : directions_all_round()) {
      EXPECT_LT(angle_between_rad(front_of(spec, part.pose(toward, {})), toward), 1e-14);
      // And right at the axis, where the first angle is nobody's.
      toward = Vector3d(1e-9 * toward.x(), 1e-9 * toward.y(), toward.z() > 0 ? 1 : -1);
      EXPECT_LT(angle_between_rad(front_of(spec, part.pose(toward, {})), toward), 2e-6);
    }
  }
}

TEST(ArticulatedPart, StopsAtTheNearerEndOfItsRange) {
  PartSpec spec = panel();
  spec.axis = Vector3d::UnitZ();
  spec.front = Vector3d::UnitX();
  spec.limits_rad = PartSpec::Limits{-30.0 * kDegree, 200.0 * kDegree};
  const ArticulatedPart part(spec);
  const auto angle_deg = [&](double sun_deg) {
    const double sun = sun_deg * kDegree;
    return part.pose({std::cos(sun), std::sin(sun), 0.4}, {}).angle_rad / kDegree;
  };
  EXPECT_NEAR(angle_deg(10.0), 10.0, 1e-12);
  EXPECT_NEAR(angle_deg(-10.0), -10.0, 1e-12);
  // Beyond half a turn the range goes on, an angle by itself would not.
  EXPECT_NEAR(angle_deg(195.0), 195.0, 1e-12);
  EXPECT_NEAR(angle_deg(210.0), 200.0, 1e-12);
  EXPECT_NEAR(angle_deg(-40.0), -30.0, 1e-12);
  EXPECT_TRUE(part.pose({0, -1, 0}, {}).at_limit);
  // What stands at an end is not kept from anything, whichever way it rounds.
  spec.limits_rad = PartSpec::Limits{0.0, 0.5 * kPi};
  for (const double off : {-1e-15, 0.0, 1e-15}) {
    EXPECT_FALSE(ArticulatedPart(spec).pose({1, off, 0.4}, {}).at_limit) << off;
    EXPECT_NEAR(ArticulatedPart(spec).pose({1, off, 0.4}, {}).angle_rad, 0.0, 1e-14) << off;
  }
  EXPECT_FALSE(part.pose({0, 1, 0}, {}).at_limit);
}

TEST(ArticulatedPart, StaysWhereNothingSaysHowItShouldStand) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const bool gimbal : {false, true}) {
    PartSpec spec = panel();
    spec.axis = Vector3d::UnitZ();
    spec.front = Vector3d::UnitX();
    if (gimbal) spec.second_axis = Vector3d::UnitY();
    const ArticulatedPart part(spec);
    for (const Vector3d& toward :
         {Vector3d(0, 0, 0), Vector3d(kNan, 0, 1), Vector3d(kInfinity, 0, 0)}) {
      EXPECT_EQ(part.pose(toward, {}).from_owner, Eigen::Matrix3d::Identity()) << gimbal;
    }
    EXPECT_EQ(part.pose({0, 0, 1}, {}).angle_rad, 0.0);
  }
}

TEST(ArticulatedPart, TurnsEvenlyForDays) {
  PartSpec spec;
  spec.rate_rad_s = 2.0 * kPi / 10.0;  // a turn in ten seconds
  spec.angle_rad = 0.25 * kPi;
  const ArticulatedPart part(spec);
  const double after_days = part.pose({}, from_seconds(15 * 86400.0 + 2.5)).angle_rad;
  // 1.3e6 s of a double's last place in the angle.
  EXPECT_NEAR(after_days, 0.75 * kPi, 1e-9);
}

/// The scene of the paper's pass with parts.
struct Scene {
  Flyby flyby;
  SceneSpec spec;
  Scene() { spec.epoch = flyby.epoch; }
  [[nodiscard]] Snapshot build(std::vector<PartSpec> specs, std::vector<Companion> companions = {},
                               double t_s = kClosestOfPass3_s) const {
    Shot shot;
    shot.shutter_open = sim_time(t_s);
    shot.exposure = std::chrono::milliseconds(1);
    std::vector<ArticulatedPart> parts;
    for (PartSpec& part : specs) parts.emplace_back(std::move(part));
    return SnapshotBuilder(spec, flyby.camera, flyby.target, std::move(companions),
                           std::move(parts))
        .build(shot);
  }
};

TEST(ArticulatedPart, StandsInTheSceneAsItsBodyCarriesIt) {
  const Scene scene;
  PartSpec wing = panel();
  wing.hinge_m = {0.4, -2.0, 1.0};
  const Snapshot s = scene.build({wing});
  ASSERT_EQ(s.parts, 1U);
  const PartView& part = s.part[0];
  EXPECT_EQ(part.centre.m, wing.hinge_m);
  // A place of the part, by its own way to the camera and by its body's.
  const Vector3d in_part(0.3, 5.0, -0.2);
  const Eigen::Matrix3d to_body = part.from_target.matrix.transpose();
  const Vector3d in_body = to_body * in_part + wing.hinge_m;
  const Vector3d by_part = part.body_from_camera.matrix.transpose() * (in_part - part.camera.m);
  const Vector3d by_body = s.body_from_camera.matrix.transpose() * (in_body - s.camera.m);
  EXPECT_LT((by_part - by_body).norm(), 1e-9);
  EXPECT_LT((to_body * part.sun.toward.unit - s.sun.toward.unit).norm(), 1e-14);
  EXPECT_EQ(part.sun.irradiance_w_m2, s.sun.irradiance_w_m2);
  EXPECT_LT((to_body * part.earthshine.toward.unit - s.earthshine.toward.unit).norm(), 1e-12);
  // No other turn faces the Sun better: what is left of it across the front lies along the axis.
  const Vector3d off = part.sun.toward.unit.cross(wing.front);
  EXPECT_NEAR(off.dot(wing.axis), 0.0, 1e-12);
  EXPECT_GT(part.sun.toward.unit.dot(wing.front), 0.0);
}

TEST(ArticulatedPart, PointsAtEarthCameraAndOtherBodies) {
  const Scene scene;
  const HeldOffset beside(scene.flyby.target, {200.0, -300.0, 400.0});
  AttitudeSpec turned;
  turned.offsets.yaw_rad = 1.0;
  turned.offsets.pitch_rad = -0.4;
  const std::vector<Companion> companions = {
      {beside, scene.flyby.target, BodyAttitude(turned, scene.flyby.epoch)}};
  PartSpec dish = panel();
  dish.axis = Vector3d::UnitZ();
  dish.second_axis = Vector3d::UnitY();
  dish.front = Vector3d::UnitX();
  dish.hinge_m = {1.0, 2.0, -3.0};
  std::vector<PartSpec> specs(4, dish);
  specs[0].follows = PartFollows::kEarth;
  specs[1].follows = PartFollows::kCamera;
  specs[2].follows = PartFollows::kBody;  // the target's, at the companion
  specs[2].followed = 1;
  specs[3].follows = PartFollows::kBody;  // the companion's, at the target
  specs[3].owner = 1;
  const Snapshot s = scene.build(specs, companions);
  ASSERT_EQ(s.parts, 4U);
  const auto off_rad = [&](std::size_t i, const Vector3d& in_target) {
    // From the hinge, in the part's own axes: straight ahead.
    const PartView& part = s.part[i];
    return angle_between_rad(part.from_target.matrix * (in_target - part.centre.m), dish.front);
  };
  // Nadir is the target's +z.
  EXPECT_LT(off_rad(0, Vector3d(0, 0, 6.8e6)), 1e-5);
  EXPECT_LT(off_rad(1, s.camera.m), 1e-12);
  EXPECT_LT(off_rad(2, s.companion[0].centre.m), 1e-12);
  EXPECT_LT(off_rad(3, Vector3d::Zero()), 1e-12);
  EXPECT_EQ(s.part[3].owner, 1U);
  EXPECT_LT((s.part[3].centre.m - s.companion[0].centre.m).norm(), dish.hinge_m.norm() + 1e-9);
}

}  // namespace
}  // namespace engine
