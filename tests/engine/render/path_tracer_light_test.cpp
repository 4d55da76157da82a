#include "engine/render/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/path_tracing.h"
#include "tests/support/statistics.h"

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
using test_support::Moments;
using test_support::plate;
using test_support::render;
using test_support::Rendered;
using test_support::spec_of;
using test_support::sum_of;
using test_support::toward;

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

/// The light of a Lambert sphere of radius 1 m and albedo 1 for 1 W/m^2, in W/sr, by the angle
/// between its lamp and who looks: Lambert 1760.
double lambert_sphere_w_sr(double angle_rad) {
  return 2.0 / (3.0 * kPi) * (std::sin(angle_rad) + (kPi - angle_rad) * std::cos(angle_rad));
}

/// The flat facets' own light towards +z, without anything in the way: exact for a convex body.
double facets_light_w_sr(const Mesh& mesh, double albedo, const Vector3d& to_sun) {
  double sum = 0;
  for (const Mesh::Triangle& triangle : mesh.triangles) {
    const auto corner = [&](std::size_t i) {
      return Vector3d(mesh.vertices[triangle.corner[i]].cast<double>());
    };
    const Vector3d cross = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    if (cross.z() <= 0.0 || cross.dot(to_sun) <= 0.0) continue;
    sum += 0.5 * cross.z() * cross.normalized().dot(to_sun);
  }
  return sum * albedo / kPi;
}

/// A ball, and the camera that looks at it, with pixels of pixel_m there.
struct LambertBall {
  static constexpr double kRadius_m = 6.0;
  static constexpr double kAlbedo = 0.5;
  // A limb is seen at its own angle: at 170 deg light falls by 17 for each radian.
  static constexpr double kFar_m = 1e7;

  LambertBall(int rings, double pixel)
      : pixel_m(pixel),
        mesh(test_support::sphere(6.0F, rings, 240, "white")),
        spec(spec_of(2 * static_cast<int>(kRadius_m / pixel) + 6)),
        pool(1) {
    spec.camera.focal_length_m = spec.camera.pixel_pitch_m * kFar_m / pixel_m;
    spec.grid.beyond_frame_px = 0;
    // By need: most on edges, which a crescent has a lot of.
    spec.samples_per_pixel = 0;
    spec.noise = {1e3, 100.0, 1e9, 0.68};
    tracer = std::make_unique<PathTracer>(
        spec,
        std::make_shared<TracedTarget>(mesh,
                                       std::vector<Material>{lambert_material("white", kAlbedo)}),
        pool);
  }

  /// What a smooth ball sends, in W/sr.
  [[nodiscard]] static double smooth_w_sr(double angle_rad) {
    return kAlbedo * kSun_w_m2 * kRadius_m * kRadius_m * lambert_sphere_w_sr(angle_rad);
  }
  [[nodiscard]] double facets_w_sr(double angle_rad) const {
    return kSun_w_m2 *
           facets_light_w_sr(mesh, kAlbedo, {std::sin(angle_rad), 0, std::cos(angle_rad)});
  }
  [[nodiscard]] double traced_w_sr(double angle_rad, double rho_mc, std::uint64_t seed) {
    Snapshot snapshot = look_at_origin({0, 0, kFar_m}, kUp);
    snapshot.sun = {toward({std::sin(angle_rad), 0, std::cos(angle_rad)}), kSun_w_m2};
    snapshot.seed = seed;
    Budget budget;
    budget.rho_mc = rho_mc;
    Radiance picture;
    static_cast<void>(tracer->render(snapshot, budget, picture));
    return sum_of(picture) * std::pow(pixel_m / picture.oversampling, 2);
  }

  double pixel_m;
  Mesh mesh;
  RenderSpec spec;
  WorkerPool pool;
  std::unique_ptr<PathTracer> tracer;
};

TEST(PathTracerNoise, LambertBallFollowsItsPhaseFunction) {
  // Rings lie across a crescent: at 170 deg there are 50 of 900.
  LambertBall ball(300, 0.144);
  LambertBall crescent(900, 0.072);
  for (int deg = 0; deg <= 170; deg += 10) {
    const double a = deg * kDegree;
    LambertBall& seen = deg <= 150 ? ball : crescent;
    const double want = LambertBall::smooth_w_sr(a);
    EXPECT_NEAR(seen.facets_w_sr(a) / want, 1.0, 2.5e-4) << deg;
    Moments light;
    for (std::uint64_t seed = 1; seed <= 4; ++seed)
      light.add(seen.traced_w_sr(a, deg <= 160 ? 1.0 : 0.3, seed) / want);
    // .1 % is the facets' share and three sigma and more of noise.
    EXPECT_LT(light.sigma_of_mean(), 2e-4) << deg;
    EXPECT_NEAR(light.mean(), 1.0, 1e-3) << deg;
  }
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

}  // namespace
}  // namespace engine
