// Several bodies: what they hide, shade and light of each other.

#include "engine/render/traced_bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "engine/render/path_tracer.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test_support::add_companion;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::Moments;
using test_support::small_camera;

constexpr double kSun_w_m2 = 634.64;
constexpr double kRange_m = 100e3;  // a pixel is .144 m there
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
using Bodies = std::vector<std::shared_ptr<TracedTarget>>;

RenderSpec spec_of(int side_px, int bounces = 0) {
  RenderSpec spec;
  spec.bounces = bounces;
  spec.camera = small_camera(side_px);
  spec.grid.beyond_frame_px = 16;
  return spec;
}

Mesh plate(float width_m, float height_m, const std::string& material) {
  Mesh mesh;
  add_plate(mesh, material, {-width_m / 2, -height_m / 2, 0}, {width_m, 0, 0}, {0, height_m, 0});
  return mesh;
}

std::shared_ptr<TracedTarget> body(const Mesh& mesh) {
  return std::make_shared<TracedTarget>(
      mesh, std::vector<Material>{lambert_material("white", 0.6), lambert_material("grey", 0.2)});
}

Matrix3d some_turn() {
  return Eigen::AngleAxisd(2.0, Vector3d(1, -2, 3).normalized()).toRotationMatrix();
}

struct Rendered {
  Radiance light;
  RenderReport report;

  [[nodiscard]] double mean(int u, int v) const {
    double sum = 0;
    for (int i = 0; i < 9; ++i)
      sum += static_cast<double>(
          light.grid.at(3 * (u - light.region.left) + i % 3, 3 * (v - light.region.top) + i / 3));
    return sum / 9.0;
  }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const float x : light.grid.pixels()) total += static_cast<double>(x);
    return total;
  }
  /// No place of it is other than light can be.
  [[nodiscard]] bool sound() const {
    return std::ranges::all_of(light.grid.pixels(),
                               [](float x) { return std::isfinite(x) && x >= 0.0F; });
  }
};

/// The first is the target.
Rendered render(const RenderSpec& spec, const Bodies& bodies, const Snapshot& snapshot,
                int threads = 1) {
  WorkerPool pool(threads);
  PathTracer tracer(spec, bodies.front(), pool, {{bodies.begin() + 1, bodies.end()}, {}});
  Rendered out;
  out.report = tracer.render(snapshot, {}, out.light);
  return out;
}

Snapshot above() {
  Snapshot snapshot = look_at_origin({0, 0, kRange_m}, {0, 1, 0});
  snapshot.sun = {{Vector3d(0, 0, 1)}, kSun_w_m2};
  return snapshot;
}

double radiance(double albedo) { return albedo * kSun_w_m2 / kPi; }

TEST(TracedBodies, TheNearerBodyHidesTheOther) {
  // From 100 km away: a millimetre tells who is in front.
  const Bodies bodies{body(plate(6, 6, "white")), body(plate(3, 3, "grey"))};
  for (const Matrix3d& turn : {Matrix3d(Matrix3d::Identity()), some_turn()}) {
    for (const double height_m : {20.0, 1e-3, -1e-3, -20.0}) {
      Mesh mesh = plate(3, 3, "grey");
      for (Eigen::Vector3f& v : mesh.vertices) v = (turn * v.cast<double>()).cast<float>();
      Snapshot snapshot = above();
      add_companion(snapshot, {0, 0, height_m}, turn);
      const Rendered out = render(spec_of(64), {bodies[0], body(mesh)}, snapshot);
      const bool in_front = height_m > 0.0;
      EXPECT_NEAR(out.mean(32, 32) / radiance(in_front ? 0.2 : 0.6), 1.0, 1e-5) << height_m;
      // Its side is at 10.4 pixels from the middle, the target's at 20.8.
      EXPECT_NEAR(out.mean(47, 32) / radiance(0.6), 1.0, 1e-5) << height_m;
    }
  }
}

TEST(TracedBodies, AreTheOneMeshOfBoth) {
  // A floor and a wall, Sun from the side: hidden parts, a shadow, and light between them. The wall
  // is in axes of its own. Direct light is the same but where rounding moves an edge.
  Mesh floor;
  add_plate(floor, "white", {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
  Mesh wall;
  add_plate(wall, "grey", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
  Mesh both = floor;
  add_plate(both, "grey", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
  const Matrix3d turn = some_turn();
  const Vector3d centre(1.0, 0.5, 2.0);
  for (Eigen::Vector3f& v : wall.vertices) v = (turn * (v.cast<double>() - centre)).cast<float>();
  Snapshot snapshot = look_at_origin({136e3, 34e3, 85e3}, {0, 0, 1});
  snapshot.sun = {direction_of<BodyFrame>(Vector3d(-0.8, 0.3, 1)), kSun_w_m2};
  snapshot.earthshine = {direction_of<BodyFrame>(Vector3d(1.0, -0.3, 0.4)), 100.0};
  Snapshot with_wall = snapshot;
  add_companion(with_wall, centre, turn);

  const Rendered one = render(spec_of(64), {body(both)}, snapshot);
  const Rendered two = render(spec_of(64), {body(floor), body(wall)}, with_wall);
  ASSERT_EQ(one.light.grid.width(), two.light.grid.width());
  ASSERT_EQ(one.light.grid.height(), two.light.grid.height());
  std::size_t other = 0;
  for (std::size_t i = 0; i < one.light.grid.pixels().size(); ++i) {
    const float a = one.light.grid.pixels()[i];
    other += std::abs(a - two.light.grid.pixels()[i]) > 1e-4F * a ? 1U : 0U;
  }
  // An edge moves by 1e-6 m of cells of .05 m.
  EXPECT_LE(other, one.light.grid.pixels().size() / 1000);
  EXPECT_NEAR(two.sum() / one.sum(), 1.0, 1e-4);

  RenderSpec spec = spec_of(64, 2);
  spec.bounce_share = 1.0;
  const auto bounced = [&](const Bodies& bodies, Snapshot s) {
    Moments light;
    for (s.seed = 1; s.seed <= 12; ++s.seed) light.add(render(spec, bodies, s).sum());
    return light;
  };
  const Moments all = bounced({body(both)}, snapshot);
  const Moments parts = bounced({body(floor), body(wall)}, with_wall);
  EXPECT_GT(all.mean(), 1.02 * one.sum());
  EXPECT_NEAR(parts.mean(), all.mean(),
              4.5 * std::hypot(all.sigma_of_mean(), parts.sigma_of_mean()));
}

/// A plate of `wide_m` under a roof's straight edge, x = 0, `height_m` above; the roof is to the
/// left. The Sun is in the zenith, the camera looks from aside: `pixel_m` is across the plate in x.
struct UnderARoof {
  UnderARoof(double height_m, double wide_m, double pixel_m) : spec(spec_of(160)) {
    const auto wide = static_cast<float>(wide_m);
    const float roof_m = 6.0F * wide;
    Mesh roof;
    add_plate(roof, "grey", {-roof_m, -roof_m, 0}, {roof_m, 0, 0}, {0, 2 * roof_m, 0});
    const Matrix3d turn = some_turn();
    for (Eigen::Vector3f& v : roof.vertices) v = (turn * v.cast<double>()).cast<float>();
    bodies = {body(plate(wide, wide, "white")), body(roof)};
    const double range_m = pixel_m / spec.camera.ifov_rad();
    snapshot = look_at_origin(range_m * Vector3d(0, -std::sin(1.2), std::cos(1.2)), {0, 0, 1});
    snapshot.sun = {{Vector3d(0, 0, 1)}, kSun_w_m2};
    add_companion(snapshot, {0, 0, height_m}, turn);
    spec.samples_per_pixel = 288;
  }
  RenderSpec spec;
  Bodies bodies;
  Snapshot snapshot;
};

TEST(TracedBodies, ShadowFromKilometresAwayFallsWithinAMillimetre) {
  for (const double height_m : {10.0, 1e3, 5e3}) {
    // Twice 40 pixels of 2 mm.
    UnderARoof scene(height_m, 0.16, 2e-3);
    scene.spec.sun_disc = SunDisc::kOff;
    const Rendered out = render(scene.spec, scene.bodies, scene.snapshot);
    double lit_px = 0;
    for (int v = 75; v <= 85; ++v)
      for (int u = 45; u <= 115; ++u) lit_px += out.mean(u, v) / radiance(0.6) / 11.0;
    // From x = 0 to the right side of the last pixel. The edge's pixel is known to a tenth.
    EXPECT_NEAR(lit_px * 2e-3, 35.5 * 2e-3, 0.2e-3) << height_m;
    EXPECT_NEAR(out.mean(100, 80) / radiance(0.6), 1.0, 1e-5);
    EXPECT_EQ(out.mean(60, 80), 0.0);
  }
}

TEST(TracedBodies, ShadowsEdgeIsAsWideAsTheSunsDiscWhateverTheDistance) {
  for (const double height_m : {10.0, 1e3, 5e3}) {
    const double wide_m = 2.0 * height_m * std::tan(kSunAngularRadius_rad);
    const UnderARoof scene(height_m, 1.4 * wide_m, wide_m / 100.0);
    const Rendered out = render(scene.spec, scene.bodies, scene.snapshot);
    int between = 0;
    for (int u = 15; u < 145; ++u) {
      // How far the middle of the disc stands beside the edge, in its radii.
      const double h = std::clamp((u - 80) / 50.0, -1.0, 1.0);
      const double share = 0.5 + (h * std::sqrt(1.0 - h * h) + std::asin(h)) / kPi;
      Moments m;
      for (int v = 70; v <= 90; ++v) m.add(out.mean(u, v) / radiance(0.6));
      // In a pixel the light changes by 2/pi of 1/50.
      EXPECT_NEAR(m.mean(), share, 4.5 * m.sigma_of_mean() + 2e-3) << height_m << " " << u;
      between += share > 0.02 && share < 0.98 ? 1 : 0;
    }
    EXPECT_GT(between, 80);
  }
}

TEST(TracedBodies, WhatIsOutOfSightLeavesTheTargetAsItIs) {
  // Beside the frame, behind the camera, further than the Sun's cylinder, and no number at all:
  // the target's picture has the same bits as without it.
  const Bodies bodies{body(plate(6, 6, "white")), body(plate(6, 6, "grey"))};
  const Rendered alone = render(spec_of(64), {bodies[0]}, above());
  for (const Vector3d& centre :
       {Vector3d(30, 0, 0), Vector3d(-2e3, 1e3, 500), Vector3d(0, 2e3, 1.5 * kRange_m),
        Vector3d(0, 0, -1e6), Vector3d(kNan, 0, 0), Vector3d(kNan, kNan, kNan)}) {
    Snapshot snapshot = above();
    add_companion(snapshot, centre);
    if (centre.z() < -1e3) snapshot.companion[0].from_target.matrix *= kNan;
    const Rendered out = render(spec_of(64), bodies, snapshot);
    EXPECT_TRUE(std::ranges::equal(out.light.grid.pixels(), alone.light.grid.pixels())) << centre;
    if (centre.z() < 0.0) continue;  // hidden behind the target, and looked for
    EXPECT_EQ(out.report.rays, alone.report.rays) << centre;
    EXPECT_EQ(out.report.rejected_rays, 0U);
    EXPECT_FALSE(out.light.companions_in_sight);
    EXPECT_EQ(out.report.visible_fraction_of_companion[0], 0.0);
  }
}

TEST(TracedBodies, OneBehindTheCameraStillThrowsItsShadow) {
  const Bodies bodies{body(plate(6, 6, "white")), body(plate(60, 60, "grey"))};
  Snapshot snapshot = above();
  add_companion(snapshot, {0, 0, kRange_m + 100.0});
  RenderSpec spec = spec_of(64);
  spec.sun_disc = SunDisc::kOff;
  const Rendered out = render(spec, bodies, snapshot);
  EXPECT_GT(out.report.hits, 1000U);
  EXPECT_EQ(out.sum(), 0.0);
}

TEST(TracedBodies, OneInTheEarthsShadowIsDarkAndHidesWhatIsLit) {
  const Bodies bodies{body(plate(6, 6, "white")), body(plate(3, 3, "grey"))};
  Snapshot snapshot = above();
  add_companion(snapshot, {0, 0, 20.0}).sun.irradiance_w_m2 = 0.0;
  const Rendered out = render(spec_of(64), bodies, snapshot);
  EXPECT_EQ(out.mean(32, 32), 0.0);
  EXPECT_NEAR(out.mean(47, 32) / radiance(0.6), 1.0, 1e-5);
}

TEST(TracedBodies, TwiceTheSameBodyAtOnePlaceIsOne) {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {direction_of<BodyFrame>(Vector3d(1, 1, -1)), kSun_w_m2};
  const auto telescope =
      std::make_shared<TracedTarget>(telescope_mesh(), test_support::telescope_materials());
  const Rendered alone = render(spec_of(128), {telescope}, snapshot);
  add_companion(snapshot, Vector3d::Zero());
  const Rendered twice = render(spec_of(128), {telescope, telescope}, snapshot);
  // All of it is the target's, who is asked first.
  EXPECT_TRUE(std::ranges::equal(alone.light.grid.pixels(), twice.light.grid.pixels()));
  EXPECT_TRUE(std::ranges::equal(twice.light.grid.pixels(), twice.light.targets_grid.pixels()));
}

/// Three telescopes that share their mesh, one of them before another.
Snapshot three_telescopes() {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {direction_of<BodyFrame>(Vector3d(1, 1.3, -1)), kSun_w_m2};
  snapshot.earthshine = {direction_of<BodyFrame>(Vector3d(0, 0, 1)), 40.0};
  add_companion(snapshot, {12, 14, -8}, some_turn());
  add_companion(snapshot, {-6, 8, 5}, some_turn().transpose());
  return snapshot;
}

TEST(TracedBodies, GiveTheSameBitsOnAnyNumberOfThreadsAndHoweverTheyShareTheirMesh) {
  const auto telescope = [] {
    return std::make_shared<TracedTarget>(telescope_mesh(), test_support::telescope_materials());
  };
  const auto shared = telescope();
  const Rendered one = render(spec_of(128, 2), {shared, shared, shared}, three_telescopes());
  EXPECT_TRUE(one.sound());
  EXPECT_GT(one.sum(), 0.0);
  for (const int threads : {2, 3}) {
    const Rendered again = render(spec_of(128, 2), {telescope(), telescope(), telescope()},
                                  three_telescopes(), threads);
    EXPECT_TRUE(std::ranges::equal(one.light.grid.pixels(), again.light.grid.pixels())) << threads;
    EXPECT_TRUE(
        std::ranges::equal(one.light.targets_grid.pixels(), again.light.targets_grid.pixels()));
    EXPECT_EQ(one.report.rays, again.report.rays);
    EXPECT_EQ(again.report.rejected_rays, 0U);
  }
}

TEST(TracedBodies, TheTargetsPartIsWhatItSendsPastTheOthers) {
  // Side by side, out of each other's light: the picture of the target alone, and the rest.
  const Bodies bodies{body(plate(6, 6, "white")), body(plate(6, 6, "grey"))};
  Snapshot snapshot = look_at_origin({0, 0, kRange_m}, {0, 1, 0});
  snapshot.sun = {{Vector3d(0, 0, 1)}, kSun_w_m2};
  const Rendered alone = render(spec_of(128), {bodies[0]}, snapshot);
  // 50 pixels to a side of the middle.
  add_companion(snapshot, {7.2, 0, 0});
  const Rendered both = render(spec_of(128), bodies, snapshot);
  EXPECT_TRUE(both.light.companions_in_sight);
  const auto same = [](const PixelRect& a, const PixelRect& b) {
    return a.left == b.left && a.top == b.top && a.right == b.right && a.bottom == b.bottom;
  };
  EXPECT_TRUE(same(both.light.targets_region, alone.light.region));
  EXPECT_TRUE(std::ranges::equal(both.light.targets_grid.pixels(), alone.light.grid.pixels()));
  EXPECT_TRUE(std::ranges::equal(both.light.targets_cover.pixels(), alone.light.cover.pixels()));
  EXPECT_NEAR(both.sum() / alone.sum(), 1.0 + 0.2 / 0.6, 0.01);
}

/// A floor, a wing on a hinge at some angle over it, and a companion before both.
struct WithAWing {
  WithAWing() {
    add_plate(floor, "white", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0});
    add_plate(wing, "grey", {0, -2, 0}, {4, 0, 0}, {0, 4, 0});
    add_plate(block, "white", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    turn = Eigen::AngleAxisd(0.7, Vector3d::UnitY()).toRotationMatrix();
    hinge = {-2.0, 0.3, 2.5};
    snapshot = look_at_origin({30e3, 10e3, 90e3}, {0, 1, 0});
    snapshot.sun = {direction_of<BodyFrame>(Vector3d(-0.5, 0.2, 1)), kSun_w_m2};
  }
  /// Floor and wing in one.
  [[nodiscard]] Mesh both() const {
    Mesh mesh = floor;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Eigen::Vector3f& v : wing.vertices)
      mesh.vertices.push_back((turn.transpose() * v.cast<double>() + hinge).cast<float>());
    const std::uint32_t grey = mesh.material("grey");
    for (const Mesh::Triangle& t : wing.triangles)
      mesh.triangles.push_back(
          {{t.corner[0] + first, t.corner[1] + first, t.corner[2] + first}, grey});
    return mesh;
  }
  static void add_wing(Snapshot& s, const Vector3d& hinge, const Matrix3d& turn) {
    Snapshot alone = s;
    alone.companions = 0;
    static_cast<CompanionView&>(s.part[s.parts++]) = add_companion(alone, hinge, turn);
  }
  Mesh floor, wing, block;
  Matrix3d turn;
  Vector3d hinge;
  Snapshot snapshot;
};

TEST(TracedBodies, ATargetWithAPartIsTheOneMeshOfBoth) {
  WithAWing s;
  const Vector3d before(1.5, 1.0, 6.0);  // hides some of each
  Snapshot whole = s.snapshot;
  add_companion(whole, before);
  Snapshot in_parts = whole;
  WithAWing::add_wing(in_parts, s.hinge, s.turn);
  const auto draw = [](const Bodies& bodies, const OtherBodies& others, const Snapshot& snapshot) {
    WorkerPool pool(1);
    PathTracer tracer(spec_of(96), bodies.front(), pool, others);
    Rendered out;
    out.report = tracer.render(snapshot, {}, out.light);
    return out;
  };
  const auto block = body(s.block);
  const Rendered one = draw({body(s.both())}, {{block}, {}}, whole);
  const Rendered two = draw({body(s.floor)}, {{block}, {{body(s.wing), 0}}}, in_parts);
  const auto alike = [](const RadianceImage& a, const RadianceImage& b) {
    ASSERT_EQ(a.width(), b.width());
    ASSERT_EQ(a.height(), b.height());
    std::size_t other = 0;
    for (std::size_t i = 0; i < a.pixels().size(); ++i)
      other += std::abs(a.pixels()[i] - b.pixels()[i]) > 1e-4F * a.pixels()[i] ? 1U : 0U;
    EXPECT_LE(other, a.pixels().size() / 500);
  };
  alike(one.light.grid, two.light.grid);
  // The wing's light counts as the target's, what the companion hides of it does not.
  ASSERT_TRUE(two.light.companions_in_sight);
  alike(one.light.targets_grid, two.light.targets_grid);
  EXPECT_NEAR(two.report.visible_fraction, one.report.visible_fraction, 1e-9);
  EXPECT_GT(two.sum(), 0.0);
}

TEST(TracedBodies, ACompanionsPartIsNotTheTargets) {
  WithAWing s;
  Snapshot apart = s.snapshot;
  const Vector3d aside(9, 0, 0);
  add_companion(apart, aside);
  WithAWing::add_wing(apart, aside + s.hinge, s.turn);
  apart.part[0].owner = 1;
  WorkerPool pool(1);
  const auto floor = body(s.floor);
  PathTracer tracer(spec_of(160), floor, pool, {{body(s.block)}, {{body(s.wing), 1}}});
  Rendered with;
  with.report = tracer.render(apart, {}, with.light);
  const Rendered alone = render(spec_of(160), {floor}, s.snapshot);
  EXPECT_TRUE(with.light.companions_in_sight);
  EXPECT_TRUE(std::ranges::equal(with.light.targets_grid.pixels(), alone.light.grid.pixels()));
  // Of both together, where the block alone would be wholly in the frame.
  EXPECT_NEAR(with.report.visible_fraction_of_companion[0], 1.0, 1e-9);
  EXPECT_GT(with.sum(), 1.05 * alone.sum());
}

TEST(TracedBodies, TheTargetsOwnPartsAreNoCompanions) {
  WithAWing s;
  Snapshot in_parts = s.snapshot;
  WithAWing::add_wing(in_parts, s.hinge, s.turn);
  WorkerPool pool(1);
  PathTracer tracer(spec_of(64), body(s.floor), pool, {{}, {{body(s.wing), 0}}});
  Rendered out;
  out.report = tracer.render(in_parts, {}, out.light);
  EXPECT_FALSE(out.light.companions_in_sight);
  EXPECT_TRUE(out.light.targets_region.empty());
}

TEST(TracedBodies, NothingIsTracedBetweenThem) {
  const Bodies bodies{body(plate(3, 3, "white")), body(plate(3, 3, "grey"))};
  Snapshot snapshot = test_support::view_from({0, 0, kRange_m}, {0.6e-3, 0.6e-3, -1}, {0, 1, 0});
  snapshot.sun = {{Vector3d(0, 0, 1)}, kSun_w_m2};
  const Rendered alone = render(spec_of(1024), {bodies[0]}, snapshot);
  ASSERT_GT(alone.report.samples, 1000U);
  add_companion(snapshot, {120, 120, 0});
  const Rendered both = render(spec_of(1024), bodies, snapshot);
  // To the opposite corner; a body on other parts of pixels touches a few more or less.
  EXPECT_GT(both.light.region.width(), 700);
  EXPECT_GT(both.light.region.height(), 700);
  EXPECT_NEAR(static_cast<double>(both.report.samples) / static_cast<double>(alone.report.samples),
              2.0, 0.1);
}

TEST(TracedBodies, SurvivesACameraInsideACompanion) {
  const auto telescope =
      std::make_shared<TracedTarget>(telescope_mesh(), test_support::telescope_materials());
  for (const Vector3d& place : {Vector3d(0, 0, 0), Vector3d(0, 0, 3.0), Vector3d(8.0, 0.1, 0.2)}) {
    Snapshot snapshot = look_at_origin({300, 40, 50}, {0, 1, 0});
    snapshot.sun = {{Vector3d(0, 0, -1)}, kSun_w_m2};
    add_companion(snapshot, snapshot.camera.m - place);
    RenderSpec spec = spec_of(32, 1);
    spec.samples_per_pixel = 9;
    EXPECT_TRUE(render(spec, {telescope, telescope}, snapshot).sound());
  }
}

}  // namespace
}  // namespace engine
