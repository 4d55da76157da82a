// Meshes taken apart at their hinges, and put together again.

#include "tools/starloop/scene_bodies.h"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "tests/support/scenes.h"
#include "tests/support/temporary_folder.h"
#include "tools/starloop/rig.h"

namespace {

using starloop::Scenario;
using Settings = std::vector<std::string>;

/// A hull of two boards with a wing on either side, all in one file.
const char* const kWinged =
    "g hull\nusemtl polyimide\nv -2 -1 0\nv 2 -1 0\nv 2 1 0\nv -2 1 0\nf 1 2 3 4\n"
    "v 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nf 5 6 7 8\n"
    "g left\nusemtl silicon\nv -1 1.5 0\nv 1 1.5 0\nv 1 6 0\nv -1 6 0\nf 9 10 11 12\n"
    "g right\nv -1 -1.5 0\nv 1 -1.5 0\nv 1 -6 0\nv -1 -6 0\nf 16 15 14 13\n";

Settings operator+(Settings a, const Settings& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Settings part(const std::string& body, const std::string& group) {
  const std::string path = body + ".parts." + group;
  return {path + ".groups=" + group, path + ".axis=[0, 1, 0]", path + ".follows=sun",
          path + ".front=[0, 0, 1]", path + ".hinge_m=[0.2, 0, 0.1]"};
}

const Settings kWings = part("target", "left") + part("target", "right");

class SceneBodies : public ::testing::Test {
 protected:
  SceneBodies() : mesh_(folder_.path() / "winged.obj") { std::ofstream(mesh_) << kWinged; }

  [[nodiscard]] Scenario scenario(const Settings& settings) const {
    starloop::CommonOptions options;
    options.file = STARLOOP_SOURCE_DIR "/config/flyby.toml";
    options.overrides = Settings{"target.mesh=" + mesh_, "camera.width_px=128",
                                 "camera.height_px=128", "render.bounces=0"} +
                        settings;
    return starloop::load_scenario(options);
  }
  [[nodiscard]] std::string complaint(const Settings& settings) const {
    try {
      static_cast<void>(starloop::make_bodies(scenario(settings), nullptr));
    } catch (const engine::ConfigError& e) {
      return e.what();
    }
    return "";
  }
  const test_support::TemporaryFolder folder_;
  const std::string mesh_;
};

TEST_F(SceneBodies, AreTakenApartByGroups) {
  const starloop::SceneBodies bodies = starloop::make_bodies(scenario(kWings), nullptr);
  EXPECT_EQ(bodies.target->mesh.triangles.size(), 4U);
  ASSERT_EQ(bodies.others.parts.size(), 2U);
  EXPECT_EQ(bodies.others.parts[0].shape->mesh.triangles.size(), 2U);
  EXPECT_EQ(bodies.others.parts[0].shape->mesh.vertices.size(), 4U);
  EXPECT_EQ(bodies.triangles(), 8U);
  // Not the scenario's others: its white paint must not make the Earth's light matter.
  EXPECT_EQ(bodies.materials(), (std::set<std::string>{"polyimide", "silicon"}));
  // The hinge is the origin of the part's own axes.
  EXPECT_NEAR(static_cast<double>(bodies.others.parts[0].shape->mesh.vertices[0].x()), -1.2, 1e-6);
  EXPECT_NEAR(static_cast<double>(bodies.others.parts[0].shape->mesh.vertices[0].z()), -0.1, 1e-6);
}

TEST_F(SceneBodies, AreThereOnceWhereTheyAreTheSame) {
  const auto twin = [&](const std::string& name) {
    return Settings{"companions." + name + ".mesh=" + mesh_, "companions." + name + ".along_m=40"} +
           part("companions." + name, "left");
  };
  const starloop::SceneBodies bodies =
      starloop::make_bodies(scenario(kWings + twin("a") + twin("b")), nullptr);
  ASSERT_EQ(bodies.others.companions.size(), 2U);
  ASSERT_EQ(bodies.others.parts.size(), 4U);
  EXPECT_EQ(bodies.others.companions[0], bodies.others.companions[1]);
  EXPECT_NE(bodies.others.companions[0], bodies.target);  // that one has no right wing left
  EXPECT_EQ(bodies.others.parts[2].shape, bodies.others.parts[0].shape);
  EXPECT_EQ(bodies.others.parts[3].owner, 2U);
}

TEST_F(SceneBodies, WhatAMeshHasNotIsTold) {
  EXPECT_NE(complaint(part("target", "middle"))
                .find("names \"middle\", the mesh " + mesh_ +
                      " has the groups \"hull\", \"left\", \"right\""),
            std::string::npos);
  EXPECT_NE(complaint(kWings +
                      Settings{"target.parts.both.groups=left", "target.parts.both.axis=[0, 1, 0]"})
                .find("has the group \"left\", which another part has, too"),
            std::string::npos);
  EXPECT_NE(complaint(kWings + part("target", "hull"))
                .find("the parts that turn leave nothing of the body itself"),
            std::string::npos);
}

TEST_F(SceneBodies, FrozenPartsAreTheMovingOnesOfThatTime) {
  const double time_s = test_support::kClosestOfPass3_s;
  const auto frame_of = [&](const Settings& settings) {
    // A lamp in one direction: of the cap's samples each may meet an edge.
    Scenario s = scenario(kWings + Settings{"earth.earthshine=vector"} + settings);
    starloop::want_frames(s, engine::sim_time(time_s), engine::sim_time(time_s));
    starloop::Rig rig(s, 1);
    engine::TruthMask mask;
    engine::DnImage frame(s.scene.camera.width_px, s.scene.camera.height_px);
    const engine::FrameReport report = rig.generator().expose(
        rig.predicted_shot(engine::sim_time(time_s), s.run.exposure), {}, frame, mask);
    return std::pair(frame, report);
  };
  const std::string then = "render.parts_frozen_at_s=" + std::to_string(time_s);
  const auto [moving, with] = frame_of({});
  const auto [frozen, without] = frame_of({then, "render.method=paths"});
  ASSERT_EQ(with.truth.parts, 2U);
  EXPECT_GT(std::abs(with.truth.part[0].angle_rad), 0.01);
  EXPECT_EQ(without.truth.parts, 0U);
  EXPECT_GT(with.truth.mask_px, 100);
  std::size_t other = 0;
  for (std::size_t i = 0; i < moving.pixels().size(); ++i)
    other += moving.pixels()[i] != frozen.pixels()[i] ? 1U : 0U;
  // Rounding may move an edge over a sample.
  EXPECT_LE(other, 20U);
  // Elsewhere they stand in another way, and the picture shows it.
  const auto [late, as_before] =
      frame_of({"render.parts_frozen_at_s=306000", "render.method=paths"});
  other = 0;
  for (std::size_t i = 0; i < moving.pixels().size(); ++i)
    other += moving.pixels()[i] != late.pixels()[i] ? 1U : 0U;
  EXPECT_GT(other, 200U);
  // One body again, which the fast renderer can do.
  EXPECT_EQ(scenario(kWings + Settings{then}).render.method, engine::RenderMethod::kLattice);
  EXPECT_EQ(scenario(kWings).render.method, engine::RenderMethod::kPaths);
}

}  // namespace
