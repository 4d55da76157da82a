#include "engine/render/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::Moments;
using test_support::small_camera;

constexpr double kSun_w_m2 = 634.64;
constexpr double kRange_m = 100e3;  // a pixel is .144 m there
const Vector3d kUp(0, 1, 0);

RenderSpec spec_of(int side_px, int bounces = 0) {
  RenderSpec spec;
  spec.bounces = bounces;
  spec.camera = small_camera(side_px);
  spec.grid.beyond_frame_px = 16;
  return spec;
}

Mesh plate(float side_m = 6.0F) {
  Mesh mesh;
  add_plate(mesh, "white", {-side_m / 2, -side_m / 2, 0}, {side_m, 0, 0}, {0, side_m, 0});
  return mesh;
}

Direction<BodyFrame> toward(const Vector3d& v) { return direction_of<BodyFrame>(v); }

/// Camera above the plate, Sun in the x-z plane.
Snapshot above(double sun_deg, double sun_w_m2 = kSun_w_m2) {
  Snapshot snapshot = look_at_origin({0, 0, kRange_m}, kUp);
  snapshot.sun = {toward({std::sin(sun_deg * kDegree), 0, std::cos(sun_deg * kDegree)}), sun_w_m2};
  return snapshot;
}

struct Rendered {
  Radiance light;
  RenderReport report;

  /// Of the nine cells of a pixel, by its place on the detector.
  [[nodiscard]] std::array<float, 9> cells(int u, int v) const {
    std::array<float, 9> out{};
    for (int i = 0; i < 9; ++i) {
      out[static_cast<std::size_t>(i)] =
          light.grid.at(3 * (u - light.region.left) + i % 3, 3 * (v - light.region.top) + i / 3);
    }
    return out;
  }
  [[nodiscard]] double mean(int u, int v) const {
    double sum = 0;
    for (const float c : cells(u, v)) sum += static_cast<double>(c);
    return sum / 9.0;
  }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const float x : light.grid.pixels()) total += static_cast<double>(x);
    return total;
  }
};

Rendered render(const RenderSpec& spec, const Mesh& mesh, const std::vector<Material>& materials,
                const Snapshot& snapshot, int threads = 1, Budget budget = {}) {
  WorkerPool pool(threads);
  PathTracer tracer(spec, std::make_shared<TracedTarget>(mesh, materials), pool);
  Rendered out;
  out.report = tracer.render(snapshot, budget, out.light);
  return out;
}

TEST(PathTracer, LambertPlateIsRhoEOverPiWithoutNoise) {
  const double want = 0.3 * kSun_w_m2 / kPi;
  const Rendered out = render(spec_of(64), plate(), {lambert_material("white", 0.3)}, above(0.0));
  // The plate spans 20.8 pixels either way of (32, 32).
  for (int v = 32 - 20; v <= 32 + 20; ++v)
    for (int u = 32 - 20; u <= 32 + 20; ++u)
      for (const float cell : out.cells(u, v))
        ASSERT_NEAR(static_cast<double>(cell) / want, 1.0, 5e-7) << u << " " << v;  // a float's sum
}

TEST(PathTracer, LambertPlateFollowsTheCosineOfTheSun) {
  for (const double deg : {10.0, 45.0, 60.0, 85.0, 89.0}) {
    const Rendered out = render(spec_of(64), plate(), {lambert_material("white", 0.3)}, above(deg));
    const double want = 0.3 * kSun_w_m2 / kPi * std::cos(deg * kDegree);
    EXPECT_NEAR(out.mean(32, 32) / want, 1.0, 1e-6) << deg;
  }
  const Rendered behind =
      render(spec_of(64), plate(), {lambert_material("white", 0.3)}, above(91.0));
  EXPECT_EQ(behind.sum(), 0.0);
}

TEST(PathTracer, LambertPlateLooksAsBrightFromTheSide) {
  Snapshot snapshot = look_at_origin(kRange_m * Vector3d(std::sin(1.0), 0, std::cos(1.0)), kUp);
  snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
  const Rendered out = render(spec_of(64), plate(), {lambert_material("white", 0.3)}, snapshot);
  EXPECT_NEAR(out.mean(32, 32), 0.3 * kSun_w_m2 / kPi, 1e-4);
}

TEST(PathTracer, BothLampsAddUp) {
  Snapshot snapshot = above(30.0);
  snapshot.earthshine = {toward({0, 1, 1}), 50.0};
  const Rendered out = render(spec_of(64), plate(), {lambert_material("white", 0.3)}, snapshot);
  const double want = 0.3 / kPi * (kSun_w_m2 * std::cos(30.0 * kDegree) + 50.0 / std::sqrt(2.0));
  EXPECT_NEAR(out.mean(32, 32) / want, 1.0, 1e-6);
}

TEST(PathTracer, CoversThePlatesAreaOfTheGrid) {
  const Rendered out = render(spec_of(64), plate(), {lambert_material("white", 0.3)}, above(0.0));
  const double side_px = 6.0 / kRange_m / (6.5e-6 / 4.5);
  const double cells = out.sum() / (0.3 * kSun_w_m2 / kPi);
  // 250 cells of the rim, each covered by chance to 1/sqrt(6 samples)/2 at most: 4.5 sigma.
  EXPECT_NEAR(cells, 9.0 * side_px * side_px, 4.5 * std::sqrt(500.0) * 0.5 / std::sqrt(6.0));
}

TEST(PathTracer, PutsThePlateWhereTheCameraLooks) {
  // x to the right, y down: a plate towards +x of the camera has larger u.
  Mesh mesh;
  add_plate(mesh, "white", {1.0F, 1.0F, 0}, {1.0F, 0, 0}, {0, 1.0F, 0});  // right and up
  const Rendered out = render(spec_of(64), mesh, {lambert_material("white", 0.3)}, above(0.0));
  const int off_px = static_cast<int>(std::lround(1.5 / kRange_m / (6.5e-6 / 4.5)));
  const Snapshot snapshot = above(0.0);
  const auto middle = small_camera(64).project(snapshot.body_from_camera.matrix.transpose() *
                                               (Vector3d(1.5, 1.5, 0) - snapshot.camera.m));
  ASSERT_TRUE(middle.has_value());
  EXPECT_NEAR(std::abs(middle->u - 32.0), off_px, 1.0);
  double sum_u = 0;
  double sum_v = 0;
  for (int v = out.light.region.top; v < out.light.region.bottom; ++v) {
    for (int u = out.light.region.left; u < out.light.region.right; ++u) {
      sum_u += u * out.mean(u, v);
      sum_v += v * out.mean(u, v);
    }
  }
  const double all = out.sum() / 9.0;
  // Rim cells move it by chance: 84 of them, .2 each, over 430 cells.
  EXPECT_NEAR(sum_u / all, middle->u, 0.03);
  EXPECT_NEAR(sum_v / all, middle->v, 0.03);
}

TEST(PathTracer, WhatTheSunCannotReachIsDark) {
  // A roof beside the line of sight, between plate and Sun.
  Mesh mesh = plate();
  add_plate(mesh, "roof", {10.0F, -8.0F, 13.0F}, {6.0F, 0, 0}, {0, 16.0F, 0});
  const std::vector<Material> materials{lambert_material("white", 0.3),
                                        lambert_material("roof", 0.3)};
  const Rendered out = render(spec_of(64), mesh, materials, above(45.0));
  // The shadow of x 10..16 at height 13 falls on -3..3: all of the plate.
  for (int v = 32 - 19; v <= 32 + 19; ++v)
    for (int u = 32 - 19; u <= 32 + 19; ++u)
      for (const float cell : out.cells(u, v)) ASSERT_EQ(cell, 0.0F) << u << " " << v;
  // From the other side nothing is in the way.
  const Rendered lit = render(spec_of(64), mesh, materials, above(-45.0));
  EXPECT_GT(lit.mean(32, 32), 40.0);
}

TEST(PathTracer, ShadowHidesOneLampAndLeavesTheOther) {
  Mesh mesh = plate();
  add_plate(mesh, "white", {10.0F, -8.0F, 13.0F}, {6.0F, 0, 0}, {0, 16.0F, 0});
  Snapshot snapshot = above(45.0);
  snapshot.earthshine = {toward({-1, 0, 1}), 100.0};
  RenderSpec spec = spec_of(64);
  spec.samples_per_pixel = 900;
  const Rendered out = render(spec, mesh, {lambert_material("white", 0.3)}, snapshot);
  Moments cells;
  for (int v = 32 - 15; v <= 32 + 15; ++v)
    for (int u = 32 - 15; u <= 32 + 15; ++u)
      for (const float cell : out.cells(u, v)) cells.add(static_cast<double>(cell));
  const double want = 0.3 / kPi * 100.0 / std::sqrt(2.0);
  EXPECT_NEAR(cells.mean() / want, 1.0, 1e-6);
  EXPECT_LT(cells.variance(), 1e-10);  // each lamp is asked for by every sample
}

/// A ball of many facets, as it is and with every third face turned inside out.
std::pair<Rendered, Rendered> clean_and_flipped(const FiveParameters& surface) {
  const Mesh mesh = test_support::sphere(5.0F, 24, 48, "white");
  Mesh flipped = mesh;
  for (std::size_t i = 0; i < flipped.triangles.size(); i += 3)
    std::swap(flipped.triangles[i].corner[1], flipped.triangles[i].corner[2]);
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  return {render(spec_of(96), mesh, {{"white", surface}}, snapshot),
          render(spec_of(96), flipped, {{"white", surface}}, snapshot)};
}

TEST(PathTracer, FlippedFacesMakeTheSameImage) {
  const auto [a, b] = clean_and_flipped(test_support::lambert(0.3));
  ASSERT_EQ(a.light.grid.pixels().size(), b.light.grid.pixels().size());
  ASSERT_GT(a.sum(), 0.0);
  // Smoothing moves the normals of a flipped facet's neighbours: nothing for a Lambert surface but
  // where a mirror's glint would be. Hits on an edge may round to either side.
  EXPECT_NEAR(b.sum() / a.sum(), 1.0, 1e-4);
}

TEST(PathTracer, FlippedFacesMakeTheSameGlint) {
  const auto [a, b] = clean_and_flipped(test_support::polyimide());
  ASSERT_EQ(a.light.grid.pixels().size(), b.light.grid.pixels().size());
  EXPECT_NEAR(b.sum() / a.sum(), 1.0, 1e-4);
  const float brightest = *std::ranges::max_element(a.light.grid.pixels());
  EXPECT_NEAR(*std::ranges::max_element(b.light.grid.pixels()) / brightest, 1.0F, 1e-4F);
}

TEST(PathTracer, FacetedBallsGlintIsThatOfASmoothOne) {
  // Fine facets, narrower than the lobe, need no smoothing: the coarse ball must be as bright.
  const FiveParameters surface = test_support::polyimide();
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  const auto light = [&](int rings) {
    return render(spec_of(96), test_support::sphere(5.0F, rings, 2 * rings, "white"),
                  {{"white", surface}}, snapshot)
        .sum();
  };
  // The requirement on a smoothed glint: 5 %.
  EXPECT_NEAR(light(48) / light(400), 1.0, 0.05);
}

TEST(PathTracer, DuplicateFacesChangeNothing) {
  Mesh mesh = plate();
  const Rendered once = render(spec_of(64), mesh, {lambert_material("white", 0.3)}, above(30.0));
  const auto triangles = mesh.triangles;
  mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
  const Rendered twice = render(spec_of(64), mesh, {lambert_material("white", 0.3)}, above(30.0));
  EXPECT_TRUE(std::ranges::equal(once.light.grid.pixels(), twice.light.grid.pixels()));
}

/// The share of a facet's view, weighed with its cosine, that a polygon fills: Lambert 1760.
double form_factor(const Vector3d& at, const Vector3d& normal,
                   const std::vector<Vector3d>& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d a = (polygon[i] - at).normalized();
    const Vector3d b = (polygon[(i + 1) % polygon.size()] - at).normalized();
    const Vector3d axis = a.cross(b);
    sum += std::atan2(axis.norm(), a.dot(b)) * axis.normalized().dot(normal);
  }
  return std::abs(sum) / (2.0 * kPi);
}

TEST(PathTracer, WallIsLitByTheFloorAsItsFormFactorSays) {
  // The Sun stands in the wall's plane: only the floor is lit, and the wall sees the floor.
  constexpr double kFloor = 0.5;
  constexpr double kWall = 0.4;
  Mesh mesh;
  add_plate(mesh, "floor", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "wall", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
  RenderSpec spec = spec_of(96, 1);
  spec.samples_per_pixel = 200;
  const std::vector<Material> materials{lambert_material("floor", kFloor),
                                        lambert_material("wall", kWall)};
  const Rendered out = render(spec, mesh, materials, snapshot);
  const std::vector<Vector3d> floor{{0, -6, 0}, {8, -6, 0}, {8, 6, 0}, {0, 6, 0}};
  const double pixel_m = kRange_m * 6.5e-6 / 4.5;
  Moments ratio;
  for (int v = 48 - 15; v <= 48 + 15; ++v) {  // heights of .8 to 5.2 m
    for (int u = 48 - 30; u <= 48 + 30; ++u) {
      const double y_m = (u - 48) * pixel_m;  // symmetric in y
      const double z_m = 3.0 - (v - 48) * pixel_m;
      const double want =
          kWall * kFloor * kSun_w_m2 / kPi * form_factor({0, y_m, z_m}, {1, 0, 0}, floor);
      ratio.add(out.mean(u, v) / want);
    }
  }
  // Over a pixel of .14 m the form factor bends by (.14/.8)^2/24, .1 % at the lowest.
  EXPECT_NEAR(ratio.mean(), 1.0, 4.0 * ratio.sigma_of_mean() + 0.0005);
  EXPECT_LT(ratio.sigma_of_mean(), 0.01);
  // Without a bounce the wall is dark.
  const Rendered direct = render(spec_of(96, 0), mesh, materials, snapshot);
  EXPECT_EQ(direct.mean(48, 48), 0.0);
}

TEST(PathTracer, FurtherBouncesAddLessAndLess) {
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
  std::array<double, 4> wall{};
  for (int bounces = 0; bounces < 4; ++bounces) {
    RenderSpec spec = spec_of(96, bounces);
    spec.samples_per_pixel = 200;
    const Rendered out = render(spec, mesh, {lambert_material("grey", 0.5)}, snapshot);
    EXPECT_EQ(out.report.bounces, bounces);
    for (int v = 48 - 15; v <= 48 + 15; ++v)
      for (int u = 48 - 30; u <= 48 + 30; ++u)
        wall[static_cast<std::size_t>(bounces)] += out.mean(u, v);
  }
  EXPECT_EQ(wall[0], 0.0);
  // Wall to floor is one bounce; wall to floor to wall finds a dark wall; the third finds the floor
  // again, after two more reflections at an albedo of .5 and form factors below .5.
  const double noise = 0.01 * wall[1];  // 1900 pixels of 200 samples, a quarter of which bounce
  EXPECT_NEAR(wall[2], wall[1], noise);
  EXPECT_LT(wall[3], wall[1] * (1.0 + 0.25 * 0.25) + noise);
  EXPECT_GT(wall[3], wall[1]);
}

TEST(PathTracer, GivesTheSameBitsOnAnyNumberOfThreads) {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  snapshot.earthshine = {toward({0, 0, 1}), 40.0};
  const auto materials = test_support::telescope_materials();
  const Mesh mesh = telescope_mesh();
  const Rendered one = render(spec_of(128, 2), mesh, materials, snapshot, 1);
  EXPECT_GT(one.sum(), 0.0);
  for (const int threads : {1, 2, 3}) {
    const Rendered again = render(spec_of(128, 2), mesh, materials, snapshot, threads);
    EXPECT_TRUE(std::ranges::equal(one.light.grid.pixels(), again.light.grid.pixels())) << threads;
    EXPECT_EQ(one.report.rays, again.report.rays);
    EXPECT_EQ(one.report.hits, again.report.hits);
    EXPECT_EQ(again.report.rejected_rays, 0U);
  }
}

TEST(PathTracer, AnotherSeedOrFrameIsAnotherNoise) {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  const auto materials = test_support::telescope_materials();
  const Rendered first = render(spec_of(128), telescope_mesh(), materials, snapshot);
  snapshot.seed = 2;
  const Rendered seed = render(spec_of(128), telescope_mesh(), materials, snapshot);
  snapshot.seed = 1;
  snapshot.sequence = 1;
  const Rendered frame = render(spec_of(128), telescope_mesh(), materials, snapshot);
  EXPECT_FALSE(std::ranges::equal(first.light.grid.pixels(), seed.light.grid.pixels()));
  EXPECT_FALSE(std::ranges::equal(first.light.grid.pixels(), frame.light.grid.pixels()));
  EXPECT_NEAR(seed.sum() / first.sum(), 1.0, 0.02);
}

TEST(PathTracer, ReportsAnEmptyRegionWhenTheTargetIsOutOfSight) {
  const auto materials = std::vector<Material>{lambert_material("white", 0.3)};
  for (const Vector3d& boresight : {Vector3d(0.01, 0, -1), Vector3d(0, 0, 1), Vector3d(1, 0, 0)}) {
    Snapshot snapshot = test_support::view_from({0, 0, kRange_m}, boresight, kUp);
    snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
    snapshot.background_w_m2_sr = 0.25;
    const Rendered out = render(spec_of(64), plate(), materials, snapshot);
    EXPECT_TRUE(out.light.region.empty());
    EXPECT_EQ(out.light.grid.pixels().size(), 0U);
    EXPECT_EQ(out.light.uniform_w_m2_sr, 0.25);
    EXPECT_EQ(out.report.rays, 0U);
    EXPECT_EQ(out.report.samples, 0U);
  }
}

TEST(PathTracer, SurvivesACameraInsideItsTarget) {
  const auto materials = test_support::telescope_materials();
  for (const Vector3d& place : {Vector3d(0, 0, 0), Vector3d(0, 0, 3.0), Vector3d(8.0, 0.1, 0.2)}) {
    for (const Vector3d& boresight : {Vector3d(1, 0.1, 0), Vector3d(0, 0, -1)}) {
      Snapshot snapshot = test_support::view_from(place, boresight, kUp);
      snapshot.sun = {toward({0, 0, -1}), kSun_w_m2};
      RenderSpec spec = spec_of(32, 1);
      spec.samples_per_pixel = 9;
      const Rendered out = render(spec, telescope_mesh(), materials, snapshot);
      EXPECT_TRUE(std::ranges::all_of(out.light.grid.pixels(),
                                      [](float x) { return std::isfinite(x) && x >= 0.0F; }));
    }
  }
}

TEST(PathTracer, SurvivesASnapshotThatIsNotANumber) {
  // Counted, dark, and no abort: Embree never sees such a ray.
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Snapshot snapshot = above(0.0);
  snapshot.sun.toward.unit = {kNan, kNan, kNan};
  const auto materials = std::vector<Material>{lambert_material("white", 0.3)};
  const Rendered no_sun = render(spec_of(64, 1), plate(), materials, snapshot);
  EXPECT_TRUE(std::ranges::all_of(no_sun.light.grid.pixels(),
                                  [](float x) { return std::isfinite(x) && x >= 0.0F; }));
}

TEST(PathTracer, TakesTheBudgetOverItsOwnSetting) {
  const auto materials = std::vector<Material>{lambert_material("white", 0.3)};
  RenderSpec spec = spec_of(64);
  spec.samples_per_pixel = 50;
  EXPECT_EQ(render(spec, plate(), materials, above(0.0)).report.samples_per_pixel, 54);
  const Rendered out = render(spec, plate(), materials, above(0.0), 1, {18});
  EXPECT_EQ(out.report.samples_per_pixel, 18);
  const auto pixels = static_cast<std::uint64_t>(out.light.region.width()) *
                      static_cast<std::uint64_t>(out.light.region.height());
  EXPECT_EQ(out.report.samples, 18 * pixels);
  EXPECT_LE(out.report.hits, out.report.samples);
}

TEST(PathTracer, NoiseOfIndependentSamplesFallsAsTheirRoot) {
  // The wall of the corner: only its bounce is random.
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
  const auto variance = [&](int samples) {
    RenderSpec spec = spec_of(96, 1);
    spec.samples_per_pixel = samples;
    spec.bounce_share = 1.0;  // which samples bounce is spread evenly, and would be better
    spec.sequence = SequenceKind::kIndependent;
    const Rendered out = render(spec, mesh, {lambert_material("grey", 0.5)}, snapshot);
    Moments m;  // one height: one form factor in the middle of the wall
    for (int v = 46; v <= 50; ++v)
      for (int u = 48 - 20; u <= 48 + 20; ++u) m.add(out.mean(u, v));
    return m.variance();
  };
  // 205 pixels: the variance is known to 10 %, their ratio to 14 %, and three sigma.
  EXPECT_NEAR(variance(36) / variance(144) / 4.0, 1.0, 0.42);
}

TEST(PathTracer, LambertBallFollowsItsPhaseFunction) {
  // The light of a Lambert sphere: 2 rho E / (3 pi) r^2 (sin a + (pi - a) cos a) / pi per steradian
  // (Lambert 1760). Seen from its pole the mesh has its corners on the sphere: 240 sectors have a
  // cross-section smaller by (2 pi/240)^2/6, 1e-4. Rings are fine, for across the crescent at 170
  // deg stand 50 of them.
  constexpr double kRadius_m = 5.0;
  constexpr double kAlbedo = 0.5;
  const auto ball =
      std::make_shared<TracedTarget>(test_support::sphere(5.0F, 900, 240, "white"),
                                     std::vector<Material>{lambert_material("white", kAlbedo)});
  RenderSpec spec = spec_of(96);
  WorkerPool pool(1);
  for (const double deg : {0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 170.0}) {
    const double a = deg * kDegree;
    // A crescent is a few pixels of edge.
    spec.samples_per_pixel = deg < 100.0 ? 72 : 576;
    PathTracer tracer(spec, ball, pool);
    Snapshot snapshot = look_at_origin({0, 0, kRange_m}, kUp);
    snapshot.sun = {toward({std::sin(a), 0, std::cos(a)}), kSun_w_m2};
    Radiance light;
    static_cast<void>(tracer.render(snapshot, {}, light));
    double sum = 0;
    for (const float x : light.grid.pixels()) sum += static_cast<double>(x);
    const double cell_m2 = std::pow(kRange_m * spec.camera.ifov_rad() / 3.0, 2);
    const double want = kAlbedo * kSun_w_m2 * 2.0 / (3.0 * kPi) * kRadius_m * kRadius_m *
                        (std::sin(a) + (kPi - a) * std::cos(a)) / kPi;
    // .1 %; at 170 deg the cosine of the Sun is .08, and normals that are up to .75 deg off by the
    // sectors change it by 1e-4: .1 % more, for the light's and the view's.
    EXPECT_NEAR(sum * cell_m2 / want / kPi, 1.0, deg < 160.0 ? 1e-3 : 3e-3) << deg;
  }
}

/// A telescope with two lamps.
Snapshot telescope_view() {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  snapshot.earthshine = {toward({0, 0, 1}), 40.0};
  return snapshot;
}

/// A camera in a hurry: 1 W/m^2/sr is so many electrons.
const SensorNoise kSensor{10.0, 22.2, 30000.0, 0.68};

TEST(PathTracer, SequencesAndSamplersAgreeInTheMean) {
  const auto target =
      std::make_shared<TracedTarget>(telescope_mesh(), test_support::telescope_materials());
  WorkerPool pool(2);
  const auto mean_light = [&](SequenceKind sequence, BrdfSampler sampler) {
    RenderSpec spec = spec_of(128, 2);
    spec.sequence = sequence;
    spec.sampler = sampler;
    spec.bounce_share = 0.5;
    PathTracer tracer(spec, target, pool);
    Snapshot snapshot = telescope_view();
    Moments m;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      snapshot.seed = seed;
      Radiance light;
      static_cast<void>(tracer.render(snapshot, {36}, light));
      double sum = 0;
      for (const float x : light.grid.pixels()) sum += static_cast<double>(x);
      m.add(sum);
    }
    return m;
  };
  const Moments usual = mean_light(SequenceKind::kSobol, BrdfSampler::kMixture);
  for (const auto& [sequence, sampler] :
       {std::pair(SequenceKind::kIndependent, BrdfSampler::kMixture),
        std::pair(SequenceKind::kSobol, BrdfSampler::kCosine),
        std::pair(SequenceKind::kSobol, BrdfSampler::kUniform)}) {
    const Moments other = mean_light(sequence, sampler);
    // Student's t for 22 degrees of freedom: 4.5 is 1e-4.
    EXPECT_NEAR(other.mean(), usual.mean(),
                4.5 * std::hypot(usual.sigma_of_mean(), other.sigma_of_mean()));
    if (sequence == SequenceKind::kIndependent) {
      EXPECT_GT(other.variance(), usual.variance());
    }
  }
  // The cone finds less.
  const Moments cone = mean_light(SequenceKind::kSobol, BrdfSampler::kPaperCone);
  EXPECT_LT(cone.mean(), usual.mean() - 5.0 * usual.sigma_of_mean());
}

TEST(PathTracer, ShadowsEdgeIsAsWideAsTheSunsDisc) {
  // A roof's straight edge, parallel to y, throws its shadow on a plate 20 m below: the light rises
  // over 20 m times the disc's angle, by the share of a disc beside a line.
  constexpr double kHeight_m = 20.0;
  Mesh mesh = plate(4.0F);
  add_plate(mesh, "roof", {-20.0F, -8.0F, 20.0F}, {40.0F, 0, 0}, {0, 16.0F, 0});
  // The Sun at 45 deg: rays through the roof's edge at x = 20 meet the plate at x = 0.
  const double range_m = 2e3;  // a pixel of 2.9 mm
  Snapshot snapshot =
      test_support::view_from({0.0, -range_m, 0.02 * range_m}, {0, 1, -0.02}, {0, 0, 1});
  snapshot.camera.m = Vector3d(0, -range_m * std::cos(0.5), range_m * std::sin(0.5));
  snapshot = test_support::look_at_origin(snapshot.camera.m, {0, 0, 1});
  snapshot.sun = {toward({1, 0, 1}), kSun_w_m2};
  RenderSpec spec = spec_of(160);
  spec.samples_per_pixel = 288;
  spec.sun_disc = SunDisc::kOn;
  const std::vector<Material> materials{lambert_material("white", 0.3),
                                        lambert_material("roof", 0.3)};
  const Rendered soft = render(spec, mesh, materials, snapshot);
  spec.sun_disc = SunDisc::kOff;
  const Rendered hard = render(spec, mesh, materials, snapshot);
  const double lit = 0.3 * kSun_w_m2 / kPi * std::cos(45.0 * kDegree);
  const double pixel_m = range_m * spec.camera.ifov_rad();
  int between = 0;
  for (int u = 5; u < 155; ++u) {
    const double x_m = (u - 80) * pixel_m;
    // How far the centre of the disc stands above the edge, in its radii. The edge is at
    // 20 / cos 45 from the plate, and x is seen across the beam by cos 45.
    const double distance_m = kHeight_m / std::cos(45.0 * kDegree);
    const double above =
        x_m * std::cos(45.0 * kDegree) / distance_m / std::tan(kSunAngularRadius_rad);
    const double h = std::clamp(above, -1.0, 1.0);
    const double share = 0.5 + (h * std::sqrt(1.0 - h * h) + std::asin(h)) / kPi;
    Moments m;
    for (int v = 70; v <= 90; ++v) m.add(soft.mean(u, v) / lit);
    // 21 pixels; within one, the light changes by up to 2/pi of pixel over radius, 2 %.
    EXPECT_NEAR(m.mean(), share, 4.0 * m.sigma_of_mean() + 2e-3) << u;
    between += share > 0.02 && share < 0.98 ? 1 : 0;
    const double hard_light = hard.mean(u, 80) / lit;
    if (std::abs(x_m) > pixel_m) {
      EXPECT_NEAR(hard_light, x_m > 0.0 ? 1.0 : 0.0, 1e-5) << u;
    }
  }
  // 9.3 mm for each metre of distance, across the beam.
  EXPECT_NEAR(between * pixel_m, 0.0093 * kHeight_m / std::pow(std::cos(45.0 * kDegree), 2),
              0.15 * 0.37);
}

/// The image that a scene has, from many samples of many seeds, by pixel.
std::vector<double> converged(const RenderSpec& spec, const std::shared_ptr<TracedTarget>& target,
                              Snapshot snapshot, int seeds, int samples) {
  WorkerPool pool(2);
  PathTracer tracer(spec, target, pool);
  std::vector<double> sum;
  for (int seed = 0; seed < seeds; ++seed) {
    snapshot.seed = 1000 + static_cast<std::uint64_t>(seed);
    Radiance light;
    static_cast<void>(tracer.render(snapshot, {samples}, light));
    sum.resize(light.grid.pixels().size());
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += static_cast<double>(light.grid.pixels()[i]) / seeds;
  }
  return sum;
}

/// The root mean square over lit pixels of an image's error, after a Gaussian of 0.68 px on the
/// grid's cells, over the sensor's sigma. Written once more, cell by cell.
double true_rho(const Radiance& light, const std::vector<double>& truth) {
  const int width = light.grid.width();
  const int height = light.grid.height();
  const double blur_cells = 0.68 * 3.0;
  const auto spread = [&](const std::vector<double>& in) {
    std::vector<double> lines(in.size());
    std::vector<double> out(in.size());
    for (int pass = 0; pass < 2; ++pass) {
      const std::vector<double>& from = pass == 0 ? in : lines;
      std::vector<double>& to = pass == 0 ? lines : out;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          double sum = 0;
          for (int k = -10; k <= 10; ++k) {
            const int at_x = pass == 0 ? x + k : x;
            const int at_y = pass == 0 ? y : y + k;
            if (at_x < 0 || at_y < 0 || at_x >= width || at_y >= height) continue;
            sum += from[static_cast<std::size_t>(at_y * width + at_x)] *
                   std::exp(-0.5 * k * k / (blur_cells * blur_cells)) /
                   (blur_cells * std::sqrt(2.0 * kPi));
          }
          to[static_cast<std::size_t>(y * width + x)] = sum;
        }
      }
    }
    return out;
  };
  std::vector<double> error(truth.size());
  for (std::size_t i = 0; i < error.size(); ++i)
    error[i] = static_cast<double>(light.grid.pixels()[i]) - truth[i];
  const std::vector<double> blurred = spread(error);
  const std::vector<double> signal = spread(truth);
  double sum = 0;
  int lit = 0;
  for (int y = 1; y < height; y += 3) {
    for (int x = 1; x < width; x += 3) {
      const auto i = static_cast<std::size_t>(y * width + x);
      const double mean_e = signal[i] * kSensor.e_per_radiance;
      if (mean_e <= kSensor.sigma_e(0.0) || mean_e >= kSensor.full_well_e) continue;
      sum += std::pow(blurred[i] * kSensor.e_per_radiance / kSensor.sigma_e(mean_e), 2);
      ++lit;
    }
  }
  return std::sqrt(sum / lit);
}

/// Plates in a corner: edges, a shadow, and light that bounces.
struct Corner {
  Corner() {
    Mesh mesh;
    add_plate(mesh, "grey", {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
    add_plate(mesh, "grey", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
    target =
        std::make_shared<TracedTarget>(mesh, std::vector<Material>{lambert_material("grey", 0.5)});
    snapshot = look_at_origin({136e3, 34e3, 85e3}, {0, 0, 1});
    snapshot.sun = {toward({-0.2, 0.3, 1}), kSun_w_m2};
    spec = spec_of(64, 1);
    spec.noise = kSensor;
  }
  std::shared_ptr<TracedTarget> target;
  Snapshot snapshot;
  RenderSpec spec;
};

/// Its image, worked out once.
const std::vector<double>& corner_converged() {
  static const std::vector<double> truth = [] {
    const Corner corner;
    return converged(corner.spec, corner.target, corner.snapshot, 24, 2000);
  }();
  return truth;
}

TEST(PathTracerNoise, ReportedErrorIsTheTrueOne) {
  Corner corner;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  for (const int samples : {36, 144}) {
    Moments reported2;
    Moments true2;
    for (std::uint64_t seed = 1; seed <= 16; ++seed) {
      corner.snapshot.seed = seed;
      Radiance light;
      const RenderReport report = tracer.render(corner.snapshot, {samples}, light);
      ASSERT_GT(report.rho_mc.lit_px, 150);
      reported2.add(report.rho_mc.rms * report.rho_mc.rms);
      const double rho = true_rho(light, truth);
      true2.add(rho * rho);
      EXPECT_GE(report.rho_mc.worst, report.rho_mc.rms);
    }
    // The reference itself has a 300th of the variance at most; noise is averaged by a kernel on
    // pixels, not cells: 3 %.
    const double noise = std::hypot(reported2.sigma_of_mean(), true2.sigma_of_mean());
    EXPECT_NEAR(reported2.mean(), true2.mean(), 4.0 * noise + 0.06 * true2.mean()) << samples;
  }
}

TEST(PathTracerNoise, OneSampleACellKnowsNothingOfItsNoise) {
  const Corner corner;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  Radiance light;
  const RenderReport report = tracer.render(corner.snapshot, {9}, light);
  EXPECT_EQ(report.samples_per_pixel, 9);
  EXPECT_TRUE(std::isnan(report.rho_mc.rms));
}

TEST(PathTracerNoise, LimitIsMetAndCostsNoMoreThanItMust) {
  Corner corner;
  corner.spec.samples_per_pixel = 0;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  std::array<int, 3> samples{};
  const std::array<double, 3> limits{0.4, 0.19, 0.1};
  for (std::size_t i = 0; i < limits.size(); ++i) {
    Radiance light;
    Budget budget;
    budget.rho_mc = limits[i];
    const RenderReport report = tracer.render(corner.snapshot, budget, light);
    // Two hundred lit pixels, six of which share their noise: its rms is known to 12 %.
    EXPECT_LT(report.rho_mc.rms, 1.25 * limits[i]);
    EXPECT_LT(true_rho(light, truth), 1.25 * limits[i]);
    samples[i] = report.samples_per_pixel;
  }
  EXPECT_LE(samples[0], samples[1]);
  EXPECT_LT(samples[1], samples[2]);
  // As the root of the samples at the slowest.
  EXPECT_LT(samples[2], 1.5 * samples[1] * std::pow(0.19 / 0.1, 2));
  // The profile's limit holds where the budget has none.
  Radiance light;
  EXPECT_EQ(tracer.render(corner.snapshot, {}, light).samples_per_pixel, samples[1]);
}

TEST(PathTracerNoise, StoppingAddsNoBias) {
  // What the pilot saw chooses the samples, and none of it is in the image: over 200 seeds the mean
  // is the converged image's, in light and in its centre.
  Corner corner;
  corner.spec.samples_per_pixel = 0;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  Moments light_sum;
  Moments first_moment;
  double true_sum = 0;
  double true_moment = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    corner.snapshot.seed = seed;
    Radiance light;
    Budget budget;
    budget.rho_mc = 0.5;
    static_cast<void>(tracer.render(corner.snapshot, budget, light));
    double sum = 0;
    double moment = 0;
    true_sum = 0;
    true_moment = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double x = static_cast<double>(i % static_cast<std::size_t>(light.grid.width()));
      const auto value = static_cast<double>(light.grid.pixels()[i]);
      sum += value;
      moment += value * x;
      true_sum += truth[i];
      true_moment += truth[i] * x;
    }
    light_sum.add(sum);
    first_moment.add(moment);
  }
  // The reference, 24 seeds of 2000 samples, is worth more than 600 of these: a third of the noise.
  EXPECT_NEAR(light_sum.mean(), true_sum, 4.0 * 1.2 * light_sum.sigma_of_mean());
  EXPECT_NEAR(first_moment.mean(), true_moment, 4.0 * 1.2 * first_moment.sigma_of_mean());
}

/// A clock that each look moves on.
Duration g_now{};
Duration g_step{};
Duration ticking() noexcept { return g_now += g_step; }

TEST(PathTracerDeadline, StopsWhenTheNextPassWouldNotFitAndSaysWhatItReached) {
  Corner corner;
  corner.spec.clock = ticking;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  Radiance light;
  Budget budget;
  budget.samples_per_pixel = 576;  // 32 of each cell and replicate: passes of 1, 1, 2, 4, 8, 16
  g_step = Duration(1'000'000);
  budget.time = Duration(1'000'000'000);
  const RenderReport all = tracer.render(corner.snapshot, budget, light);
  EXPECT_EQ(all.passes, 6);
  EXPECT_EQ(all.samples_per_pixel, 576);
  // Each pass takes a millisecond by this clock, two with the looks between.
  budget.time = Duration(8'000'000);
  const RenderReport cut = tracer.render(corner.snapshot, budget, light);
  EXPECT_LT(cut.passes, 6);
  EXPECT_GE(cut.passes, 1);
  EXPECT_EQ(cut.samples_per_pixel, 18 << (cut.passes - 1));
  EXPECT_GT(cut.rho_mc.rms, all.rho_mc.rms);
  budget.time = Duration(1);
  EXPECT_EQ(tracer.render(corner.snapshot, budget, light).passes, 1);
}

TEST(PathTracerDeadline, ReplayObeysThePassesThatWereDone) {
  Corner corner;
  corner.spec.clock = ticking;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  g_step = Duration(1'000'000);
  for (const int samples : {576, 0}) {
    Radiance live;
    Budget budget;
    budget.samples_per_pixel = samples;
    budget.rho_mc = samples == 0 ? 0.1 : 0.0;
    budget.time = Duration(9'000'000);
    const RenderReport report = tracer.render(corner.snapshot, budget, live);
    budget.time = {};
    budget.passes = report.passes;
    Radiance replay;
    RenderSpec without_clock = corner.spec;
    without_clock.clock = nullptr;
    PathTracer other(without_clock, corner.target, pool);
    EXPECT_EQ(other.render(corner.snapshot, budget, replay).passes, report.passes);
    EXPECT_TRUE(std::ranges::equal(live.grid.pixels(), replay.grid.pixels()));
    EXPECT_TRUE(std::ranges::equal(live.cover.pixels(), replay.cover.pixels()));
  }
}

TEST(PathTracer, SumsManySamplesWithoutLosingTheirDigits) {
  // A plate's light is a constant: a hundred thousand samples of it are that constant still.
  RenderSpec spec = spec_of(16);
  spec.samples_per_pixel = 90000;
  spec.grid.beyond_frame_px = 0;
  const Rendered out = render(spec, plate(0.3F), {lambert_material("white", 0.3)}, above(0.0));
  EXPECT_NEAR(out.mean(8, 8) / (0.3 * kSun_w_m2 / kPi), 1.0, 2e-7);
}

TEST(PathTracer, SaysWhichRungsItTook) {
  RenderSpec spec = spec_of(64, 2);
  spec.bounces_left_out_e = 12.5;
  const Rendered near = render(spec, plate(), {lambert_material("white", 0.3)}, above(0.0));
  EXPECT_EQ(near.report.rungs[0].ladder, "bounces");
  EXPECT_EQ(near.report.rungs[0].taken, "2");
  EXPECT_EQ(near.report.rungs[0].error_e, 12.5);
  EXPECT_EQ(near.report.rungs[1].ladder, "sun disc");
  EXPECT_EQ(near.report.rungs[1].taken, "glints and shadows");
  // A target of 8 m throws edges of 8 cm at most: a fifth of a pixel at 270 km.
  Snapshot far = look_at_origin({0, 0, 400e3}, kUp);
  far.sun = above(0.0).sun;
  EXPECT_EQ(render(spec, plate(), {lambert_material("white", 0.3)}, far).report.rungs[1].taken,
            "glints");
  spec.sun_disc = SunDisc::kOff;
  EXPECT_EQ(render(spec, plate(), {lambert_material("white", 0.3)}, far).report.rungs[1].taken,
            "none");
}

}  // namespace
}  // namespace engine
