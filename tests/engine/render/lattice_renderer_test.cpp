#include "engine/render/lattice_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::small_camera;

constexpr double kSun_w_m2 = 634.64;
constexpr double kRange_m = 100e3;  // a pixel is .144 m there
const Vector3d kUp(0, 1, 0);

RenderSpec spec_of(int side_px, int bounces = 0) {
  RenderSpec spec;
  spec.method = RenderMethod::kLattice;
  spec.lattice_side = 8;
  spec.bounces = bounces;
  spec.camera = small_camera(side_px);
  spec.grid.beyond_frame_px = 16;
  return spec;
}

Lamp lamp(const Vector3d& toward, double irradiance_w_m2) {
  return {direction_of<BodyFrame>(toward), irradiance_w_m2};
}

Snapshot view_from(const Vector3d& camera_m, const Vector3d& to_sun) {
  Snapshot snapshot = look_at_origin(camera_m, kUp);
  snapshot.sun = lamp(to_sun, kSun_w_m2);
  return snapshot;
}

/// Six metres square, facing +z.
Mesh plate() {
  Mesh mesh;
  add_plate(mesh, "white", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0});
  return mesh;
}

double sum_of(const Radiance& light) {
  double sum = 0;
  for (const float cell : light.grid.pixels()) sum += static_cast<double>(cell);
  return sum;
}

/// A renderer of its own for each call, unless one is kept.
struct Rig {
  Rig(const RenderSpec& spec, const Mesh& mesh, const std::vector<Material>& materials,
      int threads = 1)
      : pool(threads), renderer(spec, std::make_shared<TracedTarget>(mesh, materials), pool) {}
  Radiance render(const Snapshot& snapshot, Budget budget = {}) {
    Radiance out;
    report = renderer.render(snapshot, budget, out);
    return out;
  }
  WorkerPool pool;
  LatticeRenderer renderer;
  RenderReport report;
};

std::vector<Material> telescope_materials() {
  std::vector<Material> materials = test_support::telescope_materials();
  for (Material& m : materials)
    if (m.name == "polyimide") m.wrinkle_rad = 15.0 * kDegree;
  return materials;
}

TEST(LatticeRenderer, LambertPlateIsRhoEOverPiInEveryCellItCovers) {
  for (const double deg : {0.0, 60.0, 85.0}) {
    Rig rig(spec_of(64), plate(), {lambert_material("white", 0.3)});
    const Radiance out = rig.render(
        view_from({0, 0, kRange_m}, {std::sin(deg * kDegree), 0, std::cos(deg * kDegree)}));
    const double want = 0.3 * kSun_w_m2 / kPi * std::cos(deg * kDegree);
    // The plate spans 20.8 pixels either way of the middle.
    for (int v = 32 - 20; v <= 32 + 20; ++v)
      for (int u = 32 - 20; u <= 32 + 20; ++u)
        ASSERT_NEAR(static_cast<double>(
                        out.grid.at(3 * (u - out.region.left) + 1, 3 * (v - out.region.top) + 1)) /
                        want,
                    1.0, 1e-6)
            << deg << " at " << u << " " << v;
  }
}

TEST(LatticeRenderer, CoverIsThePlatesAreaAndLightIsProportionalToIt) {
  Rig rig(spec_of(64), plate(), {lambert_material("white", 0.3)});
  const Radiance out = rig.render(view_from({0, 0, kRange_m}, {0, 0, 1}));
  const double side_cells = 3.0 * 6.0 / kRange_m / (6.5e-6 / 4.5);
  double cover = 0;
  const double full = 0.3 * kSun_w_m2 / kPi;
  for (int y = 0; y < out.grid.height(); ++y) {
    for (int x = 0; x < out.grid.width(); ++x) {
      const auto share = static_cast<double>(out.cover.at(x, y));
      cover += share;
      ASSERT_NEAR(static_cast<double>(out.grid.at(x, y)), share * full, 1e-4);
    }
  }
  // Each side lies within 1/64 of a cell: projections of the lattice's points on an axis.
  EXPECT_NEAR(cover, side_cells * side_cells, 4.0 * side_cells / 64.0);
}

TEST(LatticeRenderer, ShadowOfAPlateHasItsAreaOnTheFloor) {
  // 2 m square, 3 m above a floor of 8 m; the Sun from the zenith, the camera from the side.
  Mesh mesh;
  add_plate(mesh, "white", {-4, -4, 0}, {8, 0, 0}, {0, 8, 0});
  Mesh shaded = mesh;
  add_plate(shaded, "black", {-1, -1, 3}, {2, 0, 0}, {0, 2, 0});
  const std::vector<Material> materials = {lambert_material("white", 0.5),
                                           lambert_material("black", 0.0)};
  const Snapshot snapshot =
      view_from({kRange_m * std::sin(1.3), 0, kRange_m * std::cos(1.3)}, {0, 0, 1});
  Snapshot by_earth = snapshot;
  std::swap(by_earth.sun, by_earth.earthshine);
  for (const Snapshot& lit : {snapshot, by_earth}) {
    const double open = sum_of(Rig(spec_of(96), mesh, materials).render(lit));
    const double dark = sum_of(Rig(spec_of(96), shaded, materials).render(lit));
    // The plate's image stands beside its shadow's: 3 m tan(1.3) = 10.8 m, beyond the floor.
    EXPECT_NEAR(1.0 - dark / open, 4.0 / 64.0, 6e-4);  // edges of 8 m to a hundredth of a pixel
  }
}

TEST(LatticeRenderer, AgreesWithThePathTracerOnTheTelescope) {
  // Direct light: nothing is kept, nothing is smoothed.
  RenderSpec spec = spec_of(160);
  const Snapshot snapshot =
      view_from(Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m, {0.9, 0.5, 0.1});
  const auto target = std::make_shared<TracedTarget>(telescope_mesh(), telescope_materials());
  WorkerPool pool(2);
  LatticeRenderer lattice(spec, target, pool);
  PathTracer paths(spec, target, pool);
  Radiance a;
  Radiance b;
  (void)lattice.render(snapshot, {}, a);
  (void)paths.render(snapshot, {900}, b);
  ASSERT_EQ(a.region.width(), b.region.width());
  // 900 samples of some 4000 pixels, each good to 2 % of the mean: 1e-3 at three sigma.
  EXPECT_NEAR(sum_of(a) / sum_of(b), 1.0, 1.5e-3);
  double mean = 0;
  double square = 0;
  int lit = 0;
  for (int v = 0; v < a.region.height(); ++v) {
    for (int u = 0; u < a.region.width(); ++u) {
      double x = 0;
      double y = 0;
      for (int i = 0; i < 9; ++i) {
        x += static_cast<double>(a.grid.at(3 * u + i % 3, 3 * v + i / 3)) / 9.0;
        y += static_cast<double>(b.grid.at(3 * u + i % 3, 3 * v + i / 3)) / 9.0;
      }
      if (y <= 0.0) continue;
      ++lit;
      mean += y;
      square += (x - y) * (x - y);
    }
  }
  // The samples of the reference leave 1 % of the mean, the lattice less.
  EXPECT_LT(std::sqrt(square / lit) / (mean / lit), 0.02);
}

/// rms over pixels that a sensor of `noise` without blur sees lit, in its sigmas.
double error_in_sigmas(const Radiance& image, const Radiance& reference, const SensorNoise& noise) {
  double squares = 0;
  int lit = 0;
  for (int v = 0; v < image.region.height(); ++v) {
    for (int u = 0; u < image.region.width(); ++u) {
      double x = 0;
      double y = 0;
      for (int i = 0; i < 9; ++i) {
        x += static_cast<double>(image.grid.at(3 * u + i % 3, 3 * v + i / 3)) / 9.0;
        y += static_cast<double>(reference.grid.at(3 * u + i % 3, 3 * v + i / 3)) / 9.0;
      }
      const double sigma = noise.sigma_e(y * noise.e_per_radiance);
      if (y * noise.e_per_radiance < noise.sigma_e(0.0)) continue;
      ++lit;
      squares += std::pow((x - y) * noise.e_per_radiance / sigma, 2);
    }
  }
  return std::sqrt(squares / lit);
}

TEST(LatticeRenderer, SaysHowNoisyItIs) {
  // What it says is what a far finer reference finds, to a factor, on edges alone and with bounces.
  const Snapshot snapshot =
      view_from(Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m, {0.9, 0.5, 0.1});
  const auto target = std::make_shared<TracedTarget>(telescope_mesh(), telescope_materials());
  WorkerPool pool(2);
  for (const auto& [bounces, side] : {std::pair(0, 8), std::pair(1, 4)}) {
    RenderSpec spec = spec_of(160, bounces);
    spec.noise = {.e_per_radiance = 30.0, .dark_variance_e2 = 35.0, .full_well_e = 1e9};
    spec.sun_disc = SunDisc::kOff;  // in shadows the lattice has none
    spec.lattice_side = side;
    spec.settled = true;
    LatticeRenderer lattice(spec, target, pool);
    Radiance image;
    const RenderReport report = lattice.render(snapshot, {}, image);
    PathTracer paths(spec, target, pool);
    Radiance reference;
    const double reference_says = paths.render(snapshot, {1200}, reference).rho_mc.rms;
    const double found = error_in_sigmas(image, reference, spec.noise);
    const double net = std::sqrt(std::max(0.0, found * found - reference_says * reference_says));
    EXPECT_LT(net, 1.7 * report.rho_mc.rms) << bounces << ' ' << side;
    EXPECT_GT(net, report.rho_mc.rms / 1.7) << bounces << ' ' << side;
    EXPECT_GE(report.rho_mc.worst, report.rho_mc.rms);
  }
}

TEST(LatticeRenderer, CapOfTheEarthShinesWhereTheSkyIsOpen) {
  // A wall on a floor, and nothing but the Earth: from above, from before the wall and from behind
  // it, where the wall is in its own shade but for what the floor sends back.
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "foil", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Material foil = lambert_material("foil", 0.3);
  for (const Material& m : telescope_materials())
    if (m.name == "polyimide") foil = m;
  foil.name = "foil";
  const std::vector<Material> materials = {lambert_material("grey", 0.5), foil};
  Snapshot snapshot =
      test_support::view_from({2 * kRange_m, 0, 0.6 * kRange_m}, {-1, 0, -0.3}, {0, 0, 1});
  snapshot.sun.irradiance_w_m2 = 0.0;
  for (const Vector3d& nadir : {Vector3d(0, 0, 1), Vector3d(1, 0.2, 0.3), Vector3d(-1, 0, 0.3)}) {
    EarthDisc<BodyFrame> disc;
    disc.to_centre.unit = nadir.normalized();
    disc.to_sun.unit = (Vector3d(0.1, 0.8, 0) - 0.5 * nadir).normalized();
    disc.north.unit = Vector3d(0.3, 0.5, -0.7).normalized();
    disc.distance_radii = 1.0 + 420e3 / kEarthRadius_m;
    disc.sun_irradiance_w_m2 = kSun_w_m2;
    snapshot.earth = EarthLight(disc);
    const Vector3d vector = snapshot.earth.vector_irradiance_w_m2();
    snapshot.earthshine = lamp(vector, vector.norm());
    RenderSpec settled = spec_of(48, 1);
    settled.settled = true;
    Rig lattice(settled, mesh, materials);
    const Radiance a = lattice.render(snapshot);
    WorkerPool pool(2);
    RenderSpec spec = spec_of(48, 1);
    spec.bounce_share = 1.0;
    PathTracer paths(spec, std::make_shared<TracedTarget>(mesh, materials), pool);
    Radiance b;
    (void)paths.render(snapshot, {600}, b);
    // 64 directions of an even hemisphere stand for a cap whose limb and terminator cut bins: 1 to
    // 2 % of them are on the wrong side.
    EXPECT_NEAR(sum_of(a) / sum_of(b), 1.0, 0.02) << nadir.transpose();
  }
}

TEST(LatticeRenderer, BouncesAddWhatPathsFind) {
  // A wall on a floor, lit from above: what the wall shows has bounced off the floor.
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = lamp({0, 0, 1}, kSun_w_m2);
  const std::vector<Material> materials = {lambert_material("grey", 0.5)};
  RenderSpec settled = spec_of(96, 1);
  settled.settled = true;
  Rig lattice(settled, mesh, materials);
  const Radiance a = lattice.render(snapshot);
  WorkerPool pool(1);
  RenderSpec spec = spec_of(96, 1);
  spec.bounce_share = 1.0;
  PathTracer paths(spec, std::make_shared<TracedTarget>(mesh, materials), pool);
  Radiance b;
  (void)paths.render(snapshot, {900}, b);
  // 64 rays a texel, 9 texels a pixel, some 3000 pixels; 900 paths a pixel: edges of the wall to a
  // hundredth of a pixel are the most.
  EXPECT_NEAR(sum_of(a) / sum_of(b), 1.0, 3e-3);

  // As frames go by it gets there, and begins not far from there.
  Rig flying(spec_of(96, 1), mesh, materials);
  EXPECT_NEAR(sum_of(flying.render(snapshot)) / sum_of(b), 1.0, 0.03);
  double last = 0;
  for (int frame = 0; frame < 200; ++frame) last = sum_of(flying.render(snapshot));
  EXPECT_NEAR(last / sum_of(a), 1.0, 1e-3);

  // By the Earth alone, as in an eclipse, it is the same.
  std::swap(snapshot.sun, snapshot.earthshine);
  EXPECT_NEAR(sum_of(lattice.render(snapshot)) / sum_of(a), 1.0, 1e-5);
}

TEST(LatticeRenderer, TexelsThatAreTooNoisyGetRaysUntilTheyAreNotAndNoneGetsDarker) {
  // Two bright strips before a dark wall: each of its texels sees them in a bin or two, or misses
  // them. If those that met one were asked for more, the others would pull the mean down.
  Mesh mesh;
  add_plate(mesh, "black", {0, -6, -3}, {0, 12, 0}, {0, 0, 6});
  add_plate(mesh, "white", {3, -6, -1}, {0.3F, 0, 0}, {0, 12, 0});
  add_plate(mesh, "white", {3, -6, -2}, {0.3F, 0, 0}, {0, 12, 0});
  const std::vector<Material> materials = {lambert_material("black", 0.3),
                                           lambert_material("white", 0.9)};
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 0}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = lamp({-0.02, 0, 1}, kSun_w_m2);  // grazes the wall's back: it is dark
  RenderSpec spec = spec_of(96, 1);
  spec.settled = true;
  Rig plain(spec, mesh, materials);
  const double plain_light = sum_of(plain.render(snapshot));
  EXPECT_TRUE(std::isnan(plain.report.rho_mc.rms));  // of a camera that is not known
  spec.noise = {.e_per_radiance = 300.0, .dark_variance_e2 = 35.0, .full_well_e = 1e9};
  spec.profile.rho_mc = 1e3;
  Rig content(spec, mesh, materials);
  EXPECT_EQ(sum_of(content.render(snapshot)), plain_light);
  spec.profile.rho_mc = 0.05;
  Rig wanting(spec, mesh, materials);
  const double light = sum_of(wanting.render(snapshot));
  EXPECT_LT(wanting.report.rho_mc.rms, 0.6 * content.report.rho_mc.rms);
  EXPECT_GT(wanting.report.rays, 3 * content.report.rays);
  WorkerPool pool(2);
  RenderSpec reference = spec_of(96, 1);
  reference.bounce_share = 1.0;
  PathTracer paths(reference, std::make_shared<TracedTarget>(mesh, materials), pool);
  Radiance b;
  (void)paths.render(snapshot, {600}, b);
  // Some 3500 px of 9 texels with 64 rays, of which one or two meet light: .5 %, three times.
  EXPECT_NEAR(plain_light / sum_of(b), 1.0, 0.015);
  EXPECT_NEAR(light / sum_of(b), 1.0, 0.015);
}

TEST(LatticeRenderer, FramesAreTheSameOnAnyNumberOfThreads) {
  // What is kept grows from frame to frame: in the same way, whoever does it.
  const auto materials = telescope_materials();
  Rig one(spec_of(160, 2), telescope_mesh(), materials, 1);
  Rig three(spec_of(160, 2), telescope_mesh(), materials, 3);
  for (int frame = 0; frame < 12; ++frame) {
    // It turns, comes nearer, and the Sun goes out for a while.
    const double turned = 0.03 * frame;
    Snapshot snapshot = view_from(Vector3d(std::cos(turned), 0.4, std::sin(turned)).normalized() *
                                      kRange_m * (frame < 6 ? 1.0 : 0.5),
                                  {0.9, 0.5, 0.1 - 0.01 * frame});
    snapshot.earthshine = lamp({0, 0.1, -1}, 20.0);
    if (frame == 8 || frame == 9) snapshot.sun.irradiance_w_m2 = 0.0;
    const Radiance a = one.render(snapshot);
    const Radiance b = three.render(snapshot);
    ASSERT_TRUE(std::equal(a.grid.pixels().begin(), a.grid.pixels().end(), b.grid.pixels().begin()))
        << frame;
    ASSERT_TRUE(
        std::equal(a.cover.pixels().begin(), a.cover.pixels().end(), b.cover.pixels().begin()));
    EXPECT_GT(sum_of(a), 0.0);
  }
}

TEST(LatticeRenderer, SaysWhichRungsItTook) {
  RenderSpec spec = spec_of(64, 2);
  spec.bounces_left_out_e = 3.5;
  Rig rig(spec, plate(), {lambert_material("white", 0.3)});
  Snapshot snapshot = view_from({0, 0, kRange_m}, {0, 0, 1});
  snapshot.earthshine_rung.model = EarthshineModel::kPaperLamp;
  snapshot.earthshine_rung.error_e = 1.5;
  (void)rig.render(snapshot);
  const auto taken = [&](std::string_view ladder) {
    for (const Rung& rung : rig.report.rungs)
      if (rung.ladder == ladder) return rung;
    return Rung{};
  };
  EXPECT_EQ(taken("method").taken, "lattice");
  EXPECT_EQ(taken("bounces").taken, "2");
  EXPECT_EQ(taken("bounces").error_e, 3.5);
  EXPECT_EQ(taken("sun disc").taken, "glints");
  EXPECT_EQ(taken("earthshine").taken, name_of(EarthshineModel::kPaperLamp));
  EXPECT_EQ(taken("earthshine").error_e, 1.5);
}

TEST(LatticeRenderer, TakesTheFinestLatticeThatABudgetAllows) {
  Rig rig(spec_of(64), plate(), {lambert_material("white", 0.3)});
  const Snapshot snapshot = view_from({0, 0, kRange_m}, {0, 0, 1});
  (void)rig.render(snapshot);
  EXPECT_EQ(rig.report.samples_per_pixel, 576);
  (void)rig.render(snapshot, {200});
  EXPECT_EQ(rig.report.samples_per_pixel, 144);
  (void)rig.render(snapshot, {1});
  EXPECT_EQ(rig.report.samples_per_pixel, 36);
}

TEST(LatticeRenderer, IsFinerForWhatIsSmallUnlessASideIsAskedFor) {
  RenderSpec spec = spec_of(520);
  spec.lattice_side = 0;
  const auto points = [&](double size_px, Budget budget = {}) {
    Rig rig(spec, plate(), {lambert_material("white", 0.3)});
    const double range_m = 6.0 / size_px / spec.camera.ifov_rad();
    (void)rig.render(view_from({0, 0, range_m}, {0, 0, 1}), budget);
    return rig.report.samples_per_pixel;
  };
  EXPECT_EQ(points(500.0), 6 * 6);
  EXPECT_EQ(points(100.0), 12 * 12);
  EXPECT_EQ(points(50.0), 24 * 24);
  EXPECT_EQ(points(25.0), 48 * 48);
  EXPECT_EQ(points(3.0), 48 * 48);
  EXPECT_EQ(points(3.0, {200}), 12 * 12);
  spec.lattice_side = 2;
  EXPECT_EQ(points(3.0), 6 * 6);
}

TEST(LatticeRenderer, LeavesWhatIsTooNearToThePathTracer) {
  Rig rig(spec_of(64), plate(), {lambert_material("white", 0.3)});
  const Radiance out = rig.render(view_from({0, 0, 5.0}, {0, 0, 1}));
  EXPECT_EQ(rig.report.samples_per_pixel, 54);
  EXPECT_GT(sum_of(out), 0.0);
}

TEST(LatticeRenderer, SurvivesASnapshotThatIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Rig rig(spec_of(64, 1), plate(), {lambert_material("white", 0.3)});
  Snapshot snapshot = view_from({0, 0, kRange_m}, {0, 0, 1});
  snapshot.sun.toward.unit = Vector3d::Constant(nan);
  const Radiance out = rig.render(snapshot);
  for (const float cell : out.grid.pixels()) ASSERT_TRUE(std::isfinite(cell));
  snapshot = view_from({0, 0, kRange_m}, {0, 0, 1});
  snapshot.camera.m = Vector3d::Constant(nan);
  (void)rig.render(snapshot);
  snapshot = view_from({0, 0, kRange_m}, {0, 0, 1});
  snapshot.sun.irradiance_w_m2 = 0.0;
  EXPECT_EQ(sum_of(rig.render(snapshot)), 0.0);
}

std::vector<float> cells_of(const Radiance& light) {
  return {light.grid.pixels().begin(), light.grid.pixels().end()};
}

TEST(LatticeRenderer, WithoutBouncesForWantOfTimeALightIsADirectOne) {
  const Snapshot snapshot =
      view_from(Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m, {0.9, 0.5, 0.1});
  Rig all(spec_of(128, 1), telescope_mesh(), telescope_materials());
  RenderSpec direct = spec_of(128);
  direct.lattice_side = 2;
  Rig none(direct, telescope_mesh(), telescope_materials());
  static_cast<void>(all.render(snapshot));  // something is kept by now
  EXPECT_EQ(cells_of(all.render(snapshot, {.shed = Shed::kBounces})),
            cells_of(none.render(snapshot)));
  EXPECT_EQ(all.report.bounces, 0);
  EXPECT_EQ(all.report.samples_per_pixel, 36);
}

TEST(LatticeRenderer, WithoutRaysForWantOfTimeShadowsAreStillThere) {
  for (const Vector3d& toward : {Vector3d(0.9, 0.5, 0.1), Vector3d(-0.1, 0.3, 0.95)}) {
    const Snapshot snapshot = view_from(Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m, toward);
    Rig rig(spec_of(128, 1), telescope_mesh(), telescope_materials());
    const double by_rays = sum_of(rig.render(snapshot, {.shed = Shed::kBounces}));
    const std::uint64_t rays = rig.report.rays;
    const double by_maps = sum_of(rig.render(snapshot, {.shed = Shed::kShadows}));
    EXPECT_NEAR(by_maps / by_rays, 1.0, 0.03);
    // Where the map cannot tell either, rays still do.
    EXPECT_LT(rig.report.rays, rays / 10);
  }
}

TEST(LatticeRenderer, WhatIsKeptIsShownAsItStandsForWantOfTimeAndTakenUpAgainAfterwards) {
  const Vector3d from = Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m;
  const Snapshot snapshot = view_from(from, {0.9, 0.5, 0.1});
  RenderSpec spec = spec_of(128, 1);
  spec.lattice_side = 4;
  Rig hasty(spec, telescope_mesh(), telescope_materials());
  Rig patient(spec, telescope_mesh(), telescope_materials());
  const double first = sum_of(hasty.render(snapshot));
  static_cast<void>(patient.render(snapshot));
  const double second = sum_of(hasty.render(snapshot, {.shed = Shed::kUpkeep}));
  // The same light but for what frames after the first add to it.
  EXPECT_NEAR(second / first, 1.0, 0.002);
  const std::uint64_t rays = hasty.report.rays;
  // A frame that was left out is as if it had not been.
  EXPECT_EQ(cells_of(hasty.render(snapshot)), cells_of(patient.render(snapshot)));
  EXPECT_LT(rays, patient.report.rays);  // it had none for texels
}

TEST(LatticeRenderer, AFirstFrameForWhichThereIsNoTimeHasItsLightAllTheSame) {
  const Snapshot snapshot =
      view_from(Vector3d(0.5, 0.4, 0.77).normalized() * kRange_m, {0.9, 0.5, 0.1});
  Rig rig(spec_of(128, 1), telescope_mesh(), telescope_materials());
  Rig plain(spec_of(128, 1), telescope_mesh(), telescope_materials());
  EXPECT_EQ(cells_of(rig.render(snapshot, {.shed = Shed::kUpkeep})),
            cells_of(plain.render(snapshot)));
}

}  // namespace
}  // namespace engine
