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

}  // namespace
}  // namespace engine
