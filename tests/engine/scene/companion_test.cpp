#include "engine/scene/companion.h"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "engine/scene/snapshot_builder.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;
using test_support::kClosestOfPass3_s;

std::vector<CompanionSpec> companions_of(const std::string& text) {
  const ConfigReader config = ConfigReader::from_text(text, "x.toml");
  std::vector<CompanionSpec> companions = read_companions(config);
  config.reject_unknown_keys();
  return companions;
}

std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(companions_of(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

const std::string kOrbit =
    "[companions.b.orbit]\nsemi_major_axis_km = 7000\neccentricity = 0.001\ninclination_deg = 50\n"
    "argument_of_perigee_deg = 1\nraan_deg = 2\nmean_anomaly_deg = 3\n";

TEST(Companion, IsReadWithAnOrbitOrAnOffset) {
  const auto companions = companions_of(
      "[companions.a]\nmesh = \"a.obj\"\nalong_m = -20.5\nyaw_deg = 90\n[companions.b]\n" + kOrbit);
  ASSERT_EQ(companions.size(), 2U);
  EXPECT_EQ(companions[0].name, "a");
  EXPECT_EQ(companions[0].mesh.name, "a.obj");
  EXPECT_EQ(companions[0].mesh.where, "x.toml:2: companions.a.mesh");
  EXPECT_FALSE(companions[0].orbit.has_value());
  EXPECT_EQ(companions[0].offset.along_m, -20.5);
  EXPECT_EQ(companions[0].offset.radial_m, 0.0);
  EXPECT_DOUBLE_EQ(companions[0].attitude.offsets.yaw_rad, 0.5 * kPi);
  EXPECT_EQ(companions[1].mesh.name, "telescope");
  ASSERT_TRUE(companions[1].orbit.has_value());
  EXPECT_EQ(companions[1].orbit->elements.semi_major_axis_m, 7e6);
  EXPECT_TRUE(companions_of("").empty());
}

TEST(Companion, MayBeHeldBesideAnother) {
  const auto companions =
      companions_of("[companions.a]\nbeside = \"b\"\nalong_m = 5\n[companions.b]\n" + kOrbit +
                    "[companions.c]\nbeside = \"a\"\nalong_m = 5\n[companions.d]\nalong_m = 1\n");
  ASSERT_EQ(companions.size(), 4U);
  EXPECT_EQ(companions[0].beside, 2U);
  EXPECT_EQ(companions[2].beside, 1U);
  EXPECT_EQ(companions[3].beside, 0U);
  EXPECT_EQ(complaint_of("[companions.a]\nbeside = \"z\"\nalong_m = 5\n"),
            "x.toml:2: companions.a.beside must be \"target\" or the name of a companion, got "
            "\"z\"");
  EXPECT_EQ(complaint_of("[companions.b]\nbeside = \"target\"\n" + kOrbit),
            "x.toml:3: companions.b.orbit and beside exclude each other");
  // In a ring, one that leads into it, and beside itself.
  const std::string ring =
      "[companions.a]\nbeside = \"b\"\nalong_m = 5\n[companions.b]\nbeside = \"a\"\nalong_m = 5\n";
  for (const std::string& text : {ring, "[companions.0]\nbeside = \"a\"\nalong_m = 5\n" + ring,
                                  std::string("[companions.a]\nbeside = \"a\"\nalong_m = 5\n")})
    EXPECT_NE(complaint_of(text).find(
                  ".beside leads back to where it began: nothing of this chain has an orbit"),
              std::string::npos);
}

TEST(Companion, WhatIsWrongIsToldWithItsLine) {
  EXPECT_EQ(complaint_of("\n[companions.a]\nmesh = \"telescope\"\n"),
            "x.toml:2: companions.a must have a table orbit, or radial_m, along_m or cross_m: "
            "where it is held beside the target");
  EXPECT_EQ(complaint_of("[companions.b]\ncross_m = 1\n" + kOrbit),
            "x.toml:3: companions.b.orbit and radial_m, along_m, cross_m exclude each other");
  EXPECT_EQ(complaint_of("[companions.a]\nalong_m = nan\n").substr(0, 32),
            "x.toml:2: companions.a.along_m m");
  EXPECT_EQ(complaint_of("[companions.a]\nalong_m = 1\nspin_deg = 1\n"),
            "x.toml:3: companions.a.spin_deg is not a key of a scenario");
  EXPECT_EQ(complaint_of("[companions.a]\norbit = 5\n"),
            "x.toml:2: companions.a.orbit must be a table, got 5");
  std::string orbit = kOrbit;
  orbit.replace(orbit.find("0.001"), 5, "1.000");
  EXPECT_EQ(complaint_of(orbit).substr(0, 43), "x.toml:3: companions.b.orbit.eccentricity m");
  std::string many;
  for (int i = 10; i < 43; ++i)
    many += "[companions.c" + std::to_string(i) + "]\nalong_m = " + std::to_string(i) + "\n";
  EXPECT_EQ(complaint_of(many),
            "x.toml:65: companions.c42 is one too many: there may be 32, got 33");
}

Shot shot_at(const Flyby& flyby, double t_s) {
  Shot shot;
  shot.shutter_open = sim_time(t_s);
  shot.exposure = from_seconds(1e-3);
  shot.attitude.middle = look_along(
      sight_line(flyby.camera, flyby.target, flyby.at(t_s), LightPath::kApparent).apparent);
  shot.attitude.open = shot.attitude.close = shot.attitude.middle;
  return shot;
}

SceneSpec spec_of(const Flyby& flyby, LightPath path) {
  SceneSpec spec;
  spec.epoch = flyby.epoch;
  spec.light_path = path;
  return spec;
}

TEST(Companion, IsSeenFromWhereItsCentreSaysItIs) {
  // Without light time there is one instant for all: each body's view follows from the target's.
  const Flyby flyby;
  const HeldOffset place(flyby.target, {40.0, -300.0, 25.0});
  AttitudeSpec attitude;
  attitude.offsets = {0.3, -0.4, 1.1};
  const SnapshotBuilder builder(spec_of(flyby, LightPath::kGeometric), flyby.camera, flyby.target,
                                {{place, flyby.target, {attitude, flyby.epoch}}});
  const Snapshot s = builder.build(shot_at(flyby, kClosestOfPass3_s));
  ASSERT_EQ(s.companions, 1U);
  const CompanionView& view = s.companion[0];
  // In the orbital frame: x ahead, y against the normal, z down.
  EXPECT_LT((view.centre.m - Vector3d(-300.0, -25.0, -40.0)).norm(), 1e-8);
  const Eigen::Matrix3d& turn = view.from_target.matrix;
  EXPECT_LT((turn - body_offset(attitude.offsets).matrix).norm(), 1e-12);
  EXPECT_LT((view.camera.m - turn * (s.camera.m - view.centre.m)).norm(), 1e-7);
  EXPECT_LT((view.body_from_camera.matrix - turn * s.body_from_camera.matrix).norm(), 1e-12);
  // The Sun is as far as it is: 300 m turn it by 2e-9 rad.
  EXPECT_LT((view.sun.toward.unit - turn * s.sun.toward.unit).norm(), 1e-8);
  const auto image = CameraGeometry{}.project(s.body_from_camera.matrix.transpose() *
                                              (view.centre.m - s.camera.m));
  ASSERT_TRUE(image.has_value());
  EXPECT_NEAR(view.target_px.u, image->u, 1e-6);
  EXPECT_NEAR(view.target_px.v, image->v, 1e-6);
  EXPECT_GT(std::hypot(view.target_px.u - 512.0, view.target_px.v - 512.0), 100.0);
}

TEST(Companion, BySameOrbitIsTheTargetAgain) {
  const Flyby flyby;
  for (const LightPath path : {LightPath::kGeometric, LightPath::kApparent}) {
    const SnapshotBuilder builder(spec_of(flyby, path), flyby.camera, flyby.target,
                                  {{flyby.target, flyby.target, {}}});
    const Snapshot s = builder.build(shot_at(flyby, kClosestOfPass3_s));
    const CompanionView& view = s.companion[0];
    EXPECT_EQ(view.centre.m.norm(), 0.0);
    EXPECT_EQ(view.camera.m, s.camera.m);
    EXPECT_EQ(view.target_px.u, s.target_px.u);
    EXPECT_EQ(view.smear_px.v, s.smear_px.v);
    EXPECT_EQ(view.range_m, s.range_m);
    EXPECT_EQ(view.sun.irradiance_w_m2, s.sun.irradiance_w_m2);
    EXPECT_EQ(view.earthshine.irradiance_w_m2, s.earthshine.irradiance_w_m2);
  }
}

TEST(Companion, MayBeInTheEarthsShadowAlone) {
  // 500 km behind, it comes out of the shadow more than a minute later.
  const Flyby flyby;
  const HeldOffset place(flyby.target, {0.0, -500e3, 0.0});
  const SnapshotBuilder builder(spec_of(flyby, LightPath::kApparent), flyby.camera, flyby.target,
                                {{place, flyby.target, {}}});
  int alone = 0;
  for (double t_s = 0.0; t_s < 3000.0; t_s += 10.0) {
    const Snapshot s = builder.build(shot_at(flyby, t_s));
    alone += s.sun.irradiance_w_m2 > 0.0 && s.companion[0].sun.irradiance_w_m2 == 0.0 ? 1 : 0;
  }
  // 500 km at 7.7 km/s take 65 s.
  EXPECT_NEAR(alone, 6.5, 1.5);
}

}  // namespace
}  // namespace engine
