#include "engine/render/far_target.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/detector/detector.h"
#include "engine/optics/optics.h"
#include "engine/render/traced_target.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::small_camera;

constexpr double kSun_w_m2 = 624.0;
const Vector3d kUp(0, 1, 0);
const Vector3d kFrom = Vector3d(0.5, 0.4, 0.77).normalized();
constexpr auto kExposure = std::chrono::milliseconds(1);

std::vector<Material> white_telescope() {
  return {lambert_material("silicon", 0.3), lambert_material("polyimide", 0.6),
          lambert_material("black", 0.03)};
}

/// A renderer as scenarios make it, the paper's sensor and optics behind a small frame.
struct Rig {
  struct Choice {
    RenderMethod method = RenderMethod::kPaths;
    int side_px = 64;
    int samples = 50;
    int threads = 1;
    FarTargetForm form = FarTargetForm::kAuto;
    int bounces = 0;
    bool settled = false;  ///< a picture is whole in its first frame
  };
  Rig(const Mesh& mesh, const std::vector<Material>& materials, const Choice& choice)
      : pool(choice.threads), optics(optics_spec(choice), 1e-3 / to_e(), pool) {
    spec.method = choice.method;
    spec.samples_per_pixel = choice.samples;
    spec.bounces = choice.bounces;
    spec.far_target = choice.form;
    spec.settled = choice.settled;
    spec.camera = small_camera(choice.side_px);
    spec.grid = optics.wish();
    spec.noise = {optics.throughput_sr() * to_e(), 22.0, 30000.0, optics.noise_blur_px()};
    auto target = std::make_shared<TracedTarget>(mesh, materials);
    radius_m = target->bounding_radius_m;
    renderer = make_renderer(spec, std::move(target), pool);
  }
  static OpticsSpec optics_spec(const Choice& choice) {
    OpticsSpec spec;
    spec.camera = small_camera(choice.side_px);
    spec.largest_wing_px = 64;
    return spec;
  }
  static double to_e() { return DetectorSpec{}.electrons_per_irradiance(kExposure); }

  RenderReport render(const Snapshot& snapshot, Budget budget = {}) {
    return renderer->render(snapshot, budget, out);
  }
  /// All light, as electrons.
  [[nodiscard]] double light_e() const {
    double sum = 0;
    for (const float cell : out.grid.pixels()) sum += static_cast<double>(cell);
    sum /= out.oversampling * out.oversampling;
    for (const PointSource& p : out.points)
      sum += p.irradiance_w_m2 / std::pow(spec.camera.ifov_rad(), 2);
    return sum * spec.noise.e_per_radiance;
  }
  [[nodiscard]] double cover_px2() const {
    double sum = 0;
    for (const float cell : out.cover.pixels()) sum += static_cast<double>(cell);
    return sum / (out.oversampling * out.oversampling);
  }
  struct Seen {
    double light_e = 0;
    PixelPoint centre;
  };
  Seen project() {
    (void)optics.project(out, image);
    Seen seen;
    for (int v = 0; v < image.height(); ++v) {
      for (int u = 0; u < image.width(); ++u) {
        const double e = static_cast<double>(image.at(u, v)) * to_e();
        seen.light_e += e;
        seen.centre.u += e * u;
        seen.centre.v += e * v;
      }
    }
    seen.centre.u /= seen.light_e;
    seen.centre.v /= seen.light_e;
    return seen;
  }

  WorkerPool pool;
  Optics optics;
  RenderSpec spec;
  double radius_m = 0;
  std::unique_ptr<Renderer> renderer;
  Radiance out;
  IrradianceImage image;
};

Snapshot from_afar(double range_m, const Vector3d& to_sun = {0.9, 0.5, 0.1}) {
  Snapshot snapshot = look_at_origin(range_m * kFrom, kUp);
  snapshot.sun = {direction_of<BodyFrame>(to_sun), kSun_w_m2};
  return snapshot;
}

/// The boresight off the target, in pixels of the paper's camera.
Snapshot off_axis(double range_m, double off_u_px, double off_v_px) {
  const Snapshot straight = from_afar(range_m);
  const auto& axes = straight.body_from_camera.matrix;
  const double ifov = CameraGeometry{}.ifov_rad();
  Snapshot snapshot = test_support::view_from(
      range_m * kFrom, axes.col(2) + ifov * (off_u_px * axes.col(0) + off_v_px * axes.col(1)), kUp);
  snapshot.sun = straight.sun;
  return snapshot;
}

std::string form_of(const RenderReport& report) {
  for (const Rung& rung : report.rungs)
    if (rung.ladder == "target") return std::string(rung.taken);
  return "";
}
double error_of(const RenderReport& report) {
  for (const Rung& rung : report.rungs)
    if (rung.ladder == "target") return rung.error_e;
  return -1.0;
}

/// The truth on the detector: a point for each cell of a picture of its own.
struct Truth {
  Truth(const Mesh& mesh, const std::vector<Material>& materials, Rig& its_rig)
      : rig(its_rig), light(rig.spec, std::make_shared<TracedTarget>(mesh, materials), rig.pool) {}
  /// Instead of what the rig has drawn.
  Rig::Seen project(const Snapshot& snapshot) {
    light.update(snapshot, 0.0);
    std::ranges::fill(rig.out.grid.pixels(), 0.0F);
    rig.out.points.clear();
    for (const FarLight::Cell& cell : light.cells()) {
      const Vector3d place = static_cast<double>(cell.x_m) * light.x_axis() +
                             static_cast<double>(cell.y_m) * light.y_axis() - snapshot.camera.m;
      rig.out.points.push_back(
          {*rig.spec.camera.project(snapshot.body_from_camera.matrix.transpose() * place),
           static_cast<double>(cell.light_w_sr) / place.squaredNorm(),
           {}});
    }
    return rig.project();
  }
  Rig& rig;
  FarLight light;
};

class FarTargetOf : public testing::TestWithParam<RenderMethod> {};

TEST_P(FarTargetOf, FluxTimesRangeSquaredIsConstantFrom50To5000Km) {
  // So many samples that a resolved target's light is known to 5e-4 too.
  Rig rig(telescope_mesh(), white_telescope(), {GetParam(), 320, 800, 2});
  const bool by_lattice = GetParam() == RenderMethod::kLattice;
  double least = 1e300;
  double most = 0;
  std::vector<std::string> forms;
  for (int i = 0; i < 200; ++i) {
    const double range_m = 5e6 * std::pow(0.01, i / 199.0);
    const double size_px = 2.0 * rig.radius_m / range_m / rig.spec.camera.ifov_rad();
    // Resolved, an eighth of the steps will do.
    if (size_px > 1.2 * FarTarget::kLargest_px && i % 8 != 7) continue;
    Budget budget;
    if (!by_lattice) budget.samples_per_pixel = static_cast<int>(2e6 / (size_px * size_px)) + 9;
    forms.push_back(form_of(rig.render(from_afar(range_m), budget)));
    const double light = rig.light_e() * range_m * range_m;
    least = std::min(least, light);
    most = std::max(most, light);
  }
  EXPECT_LT(most / least - 1.0, 2e-3);
  forms.erase(std::unique(forms.begin(), forms.end()), forms.end());
  EXPECT_EQ(forms, (std::vector<std::string>{"image", "resolved"}));  // one switch
}

TEST_P(FarTargetOf, PhotocentreAndCoverDoNotJumpWhereItResolves) {
  Rig rig(telescope_mesh(), white_telescope(), {GetParam(), 96, 800, 2});
  const double range_m = 2.0 * rig.radius_m / (FarTarget::kLargest_px * rig.spec.camera.ifov_rad());
  ASSERT_EQ(form_of(rig.render(from_afar(1.001 * range_m), {3000})), "image");
  const Rig::Seen far = rig.project();
  const double far_cover = rig.cover_px2();
  ASSERT_EQ(form_of(rig.render(from_afar(0.999 * range_m), {3000})), "resolved");
  const Rig::Seen near = rig.project();
  EXPECT_NEAR(far.centre.u, near.centre.u, 0.02);
  EXPECT_NEAR(far.centre.v, near.centre.v, 0.02);
  const double grown = std::pow(1.001 / 0.999, 2);
  // Shot noise of the light is the least that the sensor adds.
  EXPECT_NEAR(near.light_e / (far.light_e * grown), 1.0,
              GetParam() == RenderMethod::kLattice ? 1e-3 : 1.0 / std::sqrt(far.light_e));
  EXPECT_NEAR(rig.cover_px2() / (far_cover * grown), 1.0, 2e-3);
}

INSTANTIATE_TEST_SUITE_P(Methods, FarTargetOf,
                         testing::Values(RenderMethod::kPaths, RenderMethod::kLattice),
                         [](const auto& method) {
                           return std::string(method.param == RenderMethod::kPaths ? "Paths"
                                                                                   : "Lattice");
                         });

TEST(FarTarget, EachFormIsTakenOnceAnApproachWhateverTheLightDoes) {
  Rig rig(telescope_mesh(), test_support::telescope_materials(), {});
  std::vector<std::string> forms;
  // The range shakes, and the Sun wanders through glints.
  for (int i = 0; i < 120; ++i) {
    const double range_m = 1e8 * std::pow(4e-3, i / 119.0) * (1.0 + 0.02 * (i % 2));
    const double turn = 0.4 * (i % 7);
    forms.push_back(
        form_of(rig.render(from_afar(range_m, {std::cos(turn), 0.5, std::sin(turn)}), {4})));
  }
  forms.erase(std::unique(forms.begin(), forms.end()), forms.end());
  EXPECT_EQ(forms, (std::vector<std::string>{"point", "moments", "image", "resolved"}));
  // And going away again.
  forms.clear();
  for (int i = 120; i >= 0; --i)
    forms.push_back(form_of(rig.render(from_afar(1e8 * std::pow(4e-3, i / 120.0)), {4})));
  forms.erase(std::unique(forms.begin(), forms.end()), forms.end());
  EXPECT_EQ(forms, (std::vector<std::string>{"resolved", "image", "moments", "point"}));
}

TEST(FarTarget, SubPixelPhaseChangesNeitherFluxNorCentroid) {
  for (const double range_m : {3e7, 6e6}) {  // a point and moments
    // All the window that light is spread over lies in the frame.
    Rig rig(telescope_mesh(), white_telescope(), {.side_px = 160, .settled = true});
    Truth truth(telescope_mesh(), white_telescope(), rig);
    double least = 1e300;
    double most = 0;
    for (int i = 0; i <= 40; ++i) {
      const Snapshot snapshot = off_axis(range_m, -i / 40.0, -0.7 * i / 40.0);
      ASSERT_NE(form_of(rig.render(snapshot)), "image");
      const Rig::Seen seen = rig.project();
      least = std::min(least, seen.light_e);
      most = std::max(most, seen.light_e);
      if (i % 20 > 0) continue;
      const Rig::Seen want = truth.project(snapshot);
      EXPECT_NEAR(seen.centre.u, want.centre.u, 1e-3);
      EXPECT_NEAR(seen.centre.v, want.centre.v, 1e-3);
    }
    EXPECT_LT(most / least - 1.0, 1e-4);
  }
}

TEST(FarTarget, WhatAFormSaysBoundsItsErrorInEveryPixel) {
  // Two lamps at the ends of a dark beam: a point's worst case.
  Mesh mesh;
  add_plate(mesh, "white", {-5, -0.5, 0}, {1, 0, 0}, {0, 1, 0});
  add_plate(mesh, "white", {3, -0.5, 0}, {2, 0, 0}, {0, 1, 0});
  add_plate(mesh, "black", {-4, -0.1F, 0}, {7, 0, 0}, {0, 0.2F, 0});
  const std::vector<Material> materials = {lambert_material("white", 0.8),
                                           lambert_material("black", 0.0)};
  for (const double range_m : {2e7, 1.2e7, 8e6, 6e6, 4e6, 2e6, 1e6, 4e5}) {
    Rig rig(mesh, materials, {.settled = true});
    Truth truth(mesh, materials, rig);
    const Snapshot snapshot = from_afar(range_m, {0.2, 0.1, 1.0});
    const RenderReport report = rig.render(snapshot);
    const double bound_e = error_of(report);
    ASSERT_GT(bound_e, 0.0);
    (void)rig.project();
    const IrradianceImage drawn = rig.image;
    (void)truth.project(snapshot);
    double worst_e = 0;
    double sigmas = 0;
    for (std::size_t i = 0; i < drawn.pixels().size(); ++i) {
      const double want_e = static_cast<double>(rig.image.pixels()[i]) * Rig::to_e();
      const double off_e = std::abs(static_cast<double>(drawn.pixels()[i]) * Rig::to_e() - want_e);
      worst_e = std::max(worst_e, off_e);
      sigmas = std::max(sigmas, off_e / rig.spec.noise.sigma_e(want_e));
    }
    // Rounding of the transform besides.
    EXPECT_LE(worst_e, bound_e + 1e-5 * rig.light_e()) << range_m;
    // Its share of all errors that the profile allows.
    if (form_of(report) != "image") {
      EXPECT_LE(sigmas, 0.3 * 0.45) << range_m;
    }
  }
}

TEST(FarTarget, AtTheFramesEdgeThePartWithinIsTold) {
  Rig rig(telescope_mesh(), white_telescope(), {.settled = true});
  const double range_m = 2e6;  // 7 px across
  const auto at_column = [&](double u) { return off_axis(range_m, 32.0 - u, 0.0); };
  EXPECT_NEAR(rig.render(at_column(32.0)).visible_fraction, 1.0, 1e-6);  // sums in single precision
  const double light = rig.light_e();
  const double half = rig.render(at_column(-0.5)).visible_fraction;
  EXPECT_GT(half, 0.2);
  EXPECT_LT(half, 0.8);
  EXPECT_NEAR(rig.light_e(), light, 1e-5 * light);  // what lies outside blurs in
  EXPECT_NEAR(rig.render(at_column(63.5)).visible_fraction, 1.0 - half, 1e-3);
  EXPECT_DOUBLE_EQ(rig.render(at_column(-10.0)).visible_fraction, 0.0);
  EXPECT_NEAR(rig.light_e(), light, 1e-5 * light);
}

TEST(FarTarget, FarOutsideOrBehindTheCameraThereIsNothing) {
  for (const double range_m : {3e7, 2e6}) {
    Rig rig(telescope_mesh(), white_telescope(), {});
    Snapshot behind = from_afar(range_m);
    behind.body_from_camera.matrix.col(2) *= -1.0;
    behind.body_from_camera.matrix.col(0) *= -1.0;
    for (const Snapshot& snapshot : {off_axis(range_m, 5000.0, 0.0), behind}) {
      const RenderReport report = rig.render(snapshot);
      EXPECT_TRUE(rig.out.region.empty());
      EXPECT_TRUE(rig.out.points.empty());
      EXPECT_EQ(report.visible_fraction, 0.0);
      EXPECT_EQ(report.rays, 0U);
      (void)rig.optics.project(rig.out, rig.image);
    }
  }
}

TEST(FarTarget, InTheEarthsShadowItIsDarkButHidesWhatIsBehind) {
  for (const double range_m : {3e7, 2e6}) {
    Rig rig(telescope_mesh(), white_telescope(), {});
    Snapshot snapshot = from_afar(range_m);
    (void)rig.render(snapshot);
    const double lit_cover = rig.cover_px2();
    snapshot.sun.irradiance_w_m2 = 0.0;
    (void)rig.render(snapshot);
    EXPECT_EQ(rig.light_e(), 0.0);
    EXPECT_GT(rig.cover_px2(), 0.0);
    EXPECT_NEAR(rig.cover_px2() / lit_cover, 1.0, 1e-6);
    for (const float cover : rig.out.cover.pixels()) EXPECT_LE(cover, 1.0F + 1e-5F);
  }
}

TEST(FarTarget, CoverIsTheOutlinesAreaInEveryForm) {
  Mesh mesh;
  add_plate(mesh, "white", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
  Rig rig(mesh, {lambert_material("white", 0.3)}, {RenderMethod::kPaths, 64, 400});
  for (const double range_m : {1e8, 1e7, 5e6, 1e6, 4e5}) {
    Snapshot snapshot = from_afar(range_m, {0, 0, 1});
    (void)rig.render(snapshot);
    const double area_m2 = 24.0 * kFrom.z();
    EXPECT_NEAR(rig.cover_px2() * std::pow(range_m * rig.spec.camera.ifov_rad(), 2) / area_m2, 1.0,
                1e-3)
        << range_m;
  }
}

TEST(FarTarget, ASmearedTargetIsTheMeanOfThoseAlongItsWay) {
  Rig rig(telescope_mesh(), white_telescope(), {});
  constexpr double kLength_px = 10.0;
  constexpr int kPlaces = 80;
  std::vector<double> mean(64 * 64, 0.0);
  for (int i = 0; i < kPlaces; ++i) {
    (void)rig.render(off_axis(3e7, kLength_px * ((i + 0.5) / kPlaces - 0.5), 0.0));
    (void)rig.project();
    for (std::size_t k = 0; k < mean.size(); ++k)
      mean[k] += static_cast<double>(rig.image.pixels()[k]) / kPlaces;
  }
  Snapshot snapshot = off_axis(3e7, 0.0, 0.0);
  snapshot.smear_px = {kLength_px, 0.0};
  (void)rig.render(snapshot);
  (void)rig.project();
  const double peak = *std::max_element(mean.begin(), mean.end());
  // Midpoints an eighth of a pixel apart; and waves that a window's edge sends back.
  for (std::size_t k = 0; k < mean.size(); ++k)
    ASSERT_NEAR(static_cast<double>(rig.image.pixels()[k]), mean[k], 3e-3 * peak) << k;
}

TEST(FarTarget, AGlintOfAFarPanelIsThatOfThePanelResolved) {
  Mesh mesh;
  add_plate(mesh, "silicon", {-3, -2, 0}, {6, 0, 0}, {0, 4, 0});
  const std::vector<Material> materials = {{"silicon", test_support::silicon()}};
  // Towards the mirror image of the Sun, and a degree off it.
  for (const double off_deg : {0.0, 1.0}) {
    const double a = off_deg * kDegree;
    const Vector3d mirrored(-kFrom.x(), -kFrom.y(), kFrom.z());
    const Vector3d to_sun = Eigen::AngleAxisd(a, mirrored.unitOrthogonal()) * mirrored;
    Rig rig(mesh, materials, {RenderMethod::kPaths, 96, 400});
    (void)rig.render(from_afar(5e6, to_sun));
    const double far = rig.light_e() * 5e6 * 5e6;
    (void)rig.render(from_afar(1e5, to_sun));
    const double near = rig.light_e() * 1e5 * 1e5;
    // 6 m at 100 km turn the view by 6e-5 rad: .6 % of the lobe's flank.
    EXPECT_NEAR(far / near, 1.0, 1e-2) << off_deg;
  }
}

TEST(FarTarget, BouncedLightIsInTheFarTargetsToo) {
  Rig direct(telescope_mesh(), white_telescope(), {});
  Rig bounced(telescope_mesh(), white_telescope(),
              {RenderMethod::kPaths, 96, 800, 2, FarTargetForm::kAuto, 2});
  (void)direct.render(from_afar(5e6));
  (void)bounced.render(from_afar(5e6));
  const double far = bounced.light_e();
  EXPECT_GT(far, 1.03 * direct.light_e());
  ASSERT_EQ(form_of(bounced.render(from_afar(5e5), {2500})), "resolved");
  EXPECT_NEAR(bounced.light_e() / (100.0 * far), 1.0, 3e-3);  // the two's noise is 1e-3
}

TEST(FarTarget, FormsCanBeForced) {
  Rig resolved(telescope_mesh(), white_telescope(),
               {RenderMethod::kPaths, 64, 50, 1, FarTargetForm::kResolved});
  EXPECT_EQ(form_of(resolved.render(from_afar(3e7))), "");
  EXPECT_TRUE(resolved.out.points.empty());
  Rig point(telescope_mesh(), white_telescope(),
            {RenderMethod::kPaths, 96, 50, 1, FarTargetForm::kPoint});
  for (const double range_m : {3e7, 1e6, 1e5}) {
    EXPECT_EQ(form_of(point.render(from_afar(range_m))), "point") << range_m;
    EXPECT_EQ(point.out.points.size(), 1U);
  }
}

TEST(FarTarget, SameBitsOnAnyNumberOfThreadsAndAgain) {
  const auto run = [](int threads) {
    Rig rig(telescope_mesh(), white_telescope(), {RenderMethod::kPaths, 96, 50, threads});
    std::vector<double> light;
    for (int i = 0; i < 24; ++i) {
      Snapshot snapshot = from_afar(2e7 * std::pow(0.02, i / 23.0), {0.9, 0.5, 0.1 + 1e-3 * i});
      snapshot.sequence = static_cast<std::uint64_t>(i);
      (void)rig.render(snapshot, {9});
      for (const float cell : rig.out.grid.pixels()) light.push_back(static_cast<double>(cell));
      for (const PointSource& p : rig.out.points) light.push_back(p.irradiance_w_m2 + p.place.u);
    }
    return light;
  };
  const std::vector<double> one = run(1);
  EXPECT_EQ(one, run(2));
  EXPECT_EQ(one, run(3));
}

TEST(FarTarget, AFrameThatIsResolvedDoesNotSpoilAPictureInTheMaking) {
  const auto light_after = [](bool interrupted) {
    Rig rig(telescope_mesh(), white_telescope(), {});
    for (int i = 0; i < 3; ++i) (void)rig.render(from_afar(5e6));
    if (interrupted) {
      EXPECT_EQ(form_of(rig.render(from_afar(1e5, {-0.9, 0.5, 0.1}))), "resolved");
    }
    for (int i = 0; i < FarLight::kBatches; ++i) (void)rig.render(from_afar(5e6));
    EXPECT_EQ(rig.render(from_afar(5e6)).rays, 0U);
    return rig.light_e();
  };
  EXPECT_EQ(light_after(true), light_after(false));
}

TEST(FarTarget, AKeptPictureCostsNoRays) {
  Rig rig(telescope_mesh(), white_telescope(), {});
  for (int i = 0; i < FarLight::kBatches; ++i) EXPECT_GT(rig.render(from_afar(5e6)).rays, 0U);
  const RenderReport again = rig.render(from_afar(4.9e6));
  EXPECT_EQ(again.rays, 0U);
  EXPECT_EQ(again.samples, 0U);
}

TEST(FarTarget, AMappedImageIsMovedAndStretchedWhateverItsForm) {
  const Mesh ball = test_support::sphere(6.0F, 12, 24, "white");
  struct Case {
    double range_m;
    RenderMethod method;
    FarTargetForm form;
    int samples;
  };
  for (const Case& c : {Case{300e3, RenderMethod::kPaths, FarTargetForm::kAuto, 2000},
                        Case{300e3, RenderMethod::kLattice, FarTargetForm::kAuto, 50},
                        Case{6000e3, RenderMethod::kLattice, FarTargetForm::kAuto, 50},
                        Case{60000e3, RenderMethod::kPaths, FarTargetForm::kPoint, 50}}) {
    const auto see = [&](const Snapshot& snapshot) {
      Rig rig(ball, {lambert_material("white", 0.5)},
              {.method = c.method,
               .side_px = 128,
               .samples = c.samples,
               .form = c.form,
               .settled = true});
      (void)rig.render(snapshot);
      return rig.project();
    };
    Snapshot snapshot = from_afar(c.range_m);
    const Rig::Seen straight = see(snapshot);
    AffineMap& map = snapshot.image_map;
    map.slope << 1.1, 0.05, -0.02, 0.95;
    const Eigen::Vector2d middle(64.0, 64.0);
    map.shift = middle - map.slope * middle + Eigen::Vector2d(3.25, -2.5);
    const Rig::Seen mapped = see(snapshot);
    const PixelPoint want = map.apply(straight.centre);
    // Two renderings' noise, and wings that the frame cuts.
    EXPECT_NEAR(mapped.centre.u, want.u, 0.05) << c.range_m;
    EXPECT_NEAR(mapped.centre.v, want.v, 0.05) << c.range_m;
    EXPECT_NEAR(mapped.light_e / straight.light_e, map.slope.determinant(), 4e-3) << c.range_m;
  }
}

}  // namespace
}  // namespace engine
