#include "engine/render/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "engine/scene/telescope.h"
#include "tests/support/path_tracing.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::above;
using test_support::add_plate;
using test_support::kRange_m;
using test_support::kSun_w_m2;
using test_support::kUp;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::plate;
using test_support::render;
using test_support::Rendered;
using test_support::small_camera;
using test_support::spec_of;
using test_support::toward;

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
  EXPECT_EQ(near.report.rungs[0].ladder, "method");
  EXPECT_EQ(near.report.rungs[0].taken, "paths");
  EXPECT_EQ(near.report.rungs[1].ladder, "bounces");
  EXPECT_EQ(near.report.rungs[1].taken, "2");
  EXPECT_EQ(near.report.rungs[1].error_e, 12.5);
  EXPECT_EQ(near.report.rungs[2].ladder, "sun disc");
  EXPECT_EQ(near.report.rungs[2].taken, "glints and shadows");
  // A target of 8 m throws edges of 8 cm at most: a fifth of a pixel at 270 km.
  Snapshot far = look_at_origin({0, 0, 400e3}, kUp);
  far.sun = above(0.0).sun;
  EXPECT_EQ(render(spec, plate(), {lambert_material("white", 0.3)}, far).report.rungs[2].taken,
            "glints");
  spec.sun_disc = SunDisc::kOff;
  EXPECT_EQ(render(spec, plate(), {lambert_material("white", 0.3)}, far).report.rungs[2].taken,
            "none");
}

}  // namespace
}  // namespace engine
