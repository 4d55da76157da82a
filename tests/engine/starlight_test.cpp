#include "engine/starlight.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

constexpr int kSide_px = 128;
constexpr double kFaint_w_m2 = 1e-7;

Snapshot looking_up() {
  Snapshot snapshot;
  const CameraAttitude attitude = look_along({{0, 0, 1}});
  snapshot.sky.attitude = {attitude, attitude, attitude};
  snapshot.sky.camera.m = {0, 0, 7e6};
  snapshot.exposure = std::chrono::milliseconds(10);
  return snapshot;
}

/// One star of the Sun's colour on the boresight.
struct Scene {
  explicit Scene(float v, int threads = 1, const VignettingSpec& vignetting = {}) : pool(threads) {
    OpticsSpec optics;
    optics.camera = test_support::small_camera(kSide_px);
    optics.vignetting = vignetting;
    shading = std::make_unique<FieldShading>(optics);
    StarCatalogue catalogue;
    CatalogueStar star;
    star.v_magnitude = v;
    star.colour_b_v = 0.653F;
    catalogue.stars = {star};
    splat = std::make_unique<PointSplat>(optics, OtfCascade(optics), kFaint_w_m2, pool);
    starlight = std::make_unique<Starlight>(
        StarField(catalogue, optics.camera, StarLight(detector.mean_wavelength_m)), *splat,
        detector);
  }
  StarReport add(const Radiance& in = {}, const Snapshot& snapshot = looking_up()) {
    image.resize(kSide_px, kSide_px);
    std::ranges::fill(image.pixels(), 0.0F);
    return starlight->add(snapshot, in, 0.0, 0.0, *shading, image);
  }
  /// The centre of the light.
  [[nodiscard]] PixelPoint centre() const {
    PixelPoint moment;
    for (int v = 0; v < kSide_px; ++v) {
      for (int u = 0; u < kSide_px; ++u) {
        moment.u += u * static_cast<double>(image.at(u, v)) / sum();
        moment.v += v * static_cast<double>(image.at(u, v)) / sum();
      }
    }
    return moment;
  }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const float x : image.pixels()) total += static_cast<double>(x);
    return total;
  }
  WorkerPool pool;
  DetectorSpec detector;
  std::unique_ptr<FieldShading> shading;
  std::unique_ptr<PointSplat> splat;
  std::unique_ptr<Starlight> starlight;
  IrradianceImage image;
};

/// Cover over the middle of the frame.
Radiance covered(float share, PixelPoint motion = {}) {
  Radiance in;
  in.region = {54, 54, 74, 74};
  in.grid.resize(60, 60);
  in.cover.resize(60, 60);
  std::ranges::fill(in.grid.pixels(), 0.0F);
  std::ranges::fill(in.cover.pixels(), share);
  in.motion_px = motion;
  return in;
}

TEST(Starlight, AStarGivesTheElectronsOfItsPhotons) {
  Scene scene(5.0F);
  const StarReport report = scene.add();
  // V = 0 sends 3.98e10 photons to a square metre in 450-850 nm; 36 cm, 70 %, 55 %, 10 ms.
  const double expected =
      band_light_at_zero(0.653).photons_m2_s * 0.01 * kPi / 4.0 * 0.36 * 0.36 * 0.7 * 0.55 * 0.01;
  EXPECT_NEAR(report.brightest_e / expected, 1.0, 1e-4);
  const double in_image =
      scene.sum() * scene.detector.electrons_per_irradiance(std::chrono::milliseconds(10));
  EXPECT_NEAR(in_image / expected, 1.0 - report.lost_flux_share, 0.2 * report.lost_flux_share);
  EXPECT_EQ(report.in_frame, 1);
  EXPECT_NEAR(report.brightest_px.u, kSide_px / 2, 1e-9);
  EXPECT_NEAR(report.brightest_v, 5.0, 1e-6);
}

TEST(Starlight, AStarThatTheDetectorCannotTellIsLeftOut) {
  // Noise of a dark pixel at 10 ms: 4.7 e-, a tenth of it over .41 of the light: 1.2 e- in all.
  const StarReport seen = Scene(16.0F).add();
  EXPECT_EQ(seen.drawn, 1);
  Scene faint(18.5F);
  const StarReport unseen = faint.add();
  EXPECT_EQ(unseen.drawn, 0);
  EXPECT_EQ(unseen.faint, 1);
  EXPECT_EQ(faint.sum(), 0.0);
  EXPECT_GT(unseen.left_out_peak_e, 0.0);
  EXPECT_LT(unseen.left_out_peak_e, 0.1 * faint.detector.noise_e(0.35));
  EXPECT_GT(unseen.left_out_e, unseen.left_out_peak_e);
}

TEST(Starlight, TheTargetDimsAStarByTheShareItCovers) {
  Scene scene(5.0F);
  (void)scene.add();
  const double free = scene.sum();
  for (const float share : {0.0F, 0.25F, 0.9F}) {
    const StarReport report = scene.add(covered(share));
    // A dimmer star is followed less far: at .1 of the light 2 % more are lost.
    EXPECT_NEAR(scene.sum() / free, 1.0 - static_cast<double>(share),
                0.03 * (1.0 - static_cast<double>(share)));
    EXPECT_EQ(report.dimmed, share > 0.0F ? 1 : 0);
  }
  (void)scene.add(covered(1.0F));
  EXPECT_EQ(scene.sum(), 0.0);
}

TEST(Starlight, AStarPassesBehindTheTargetForAPartOfItsPath) {
  // The target, 20 px wide, moves by 80 px past a star that stands still in its middle.
  const PointSource star{{63.5, 63.5}, 1.0, {}};
  EXPECT_NEAR(share_beside_target(covered(1.0F, {80.0, 0.0}), star), 0.75, 0.01);
  // With the target there is no passing.
  const PointSource along{{63.5, 63.5}, 1.0, {80.0, 0.0}};
  EXPECT_DOUBLE_EQ(share_beside_target(covered(1.0F, {80.0, 0.0}), along), 0.0);
  EXPECT_DOUBLE_EQ(share_beside_target(covered(1.0F), {{10.0, 63.5}, 1.0, {}}), 1.0);
  EXPECT_DOUBLE_EQ(share_beside_target(Radiance{}, star), 1.0);
}

TEST(Starlight, TheLastPixelOfTheCoverIsTheLastThatHides) {
  const Radiance in = covered(1.0F);
  EXPECT_DOUBLE_EQ(share_beside_target(in, {{53.49, 60.0}, 1.0, {}}), 1.0);
  EXPECT_DOUBLE_EQ(share_beside_target(in, {{53.51, 60.0}, 1.0, {}}), 0.0);
  EXPECT_DOUBLE_EQ(share_beside_target(in, {{73.49, 60.0}, 1.0, {}}), 0.0);
  EXPECT_DOUBLE_EQ(share_beside_target(in, {{73.51, 60.0}, 1.0, {}}), 1.0);
}

TEST(Starlight, AStarFollowsTheBoresightsPath) {
  Scene scene(4.0F);
  scene.add();
  const double still = scene.sum();
  const PixelPoint at_rest = scene.centre();
  Snapshot snapshot = looking_up();
  ImagePath& path = snapshot.boresight_path;
  path.bends = true;
  // Away and back: a triangle of 6 px, whose mean is half of that.
  for (int i = 0; i <= ImagePath::kSteps; ++i)
    path.off_px[static_cast<std::size_t>(i)] = {6.0 * std::abs(i - 8) / 8.0, 0.0};
  scene.add({}, snapshot);
  EXPECT_NEAR(scene.sum() / still, 1.0, 1e-3);
  EXPECT_NEAR(scene.centre().u - at_rest.u, 3.0, 0.02);
  EXPECT_NEAR(scene.centre().v - at_rest.v, 0.0, 0.02);
}

TEST(Starlight, AStarIsVignetted) {
  Scene plain(4.0F);
  Scene shaded(4.0F, 1, {.r2 = -0.5});
  const Snapshot snapshot = looking_up();
  plain.add({}, snapshot);
  shaded.add({}, snapshot);
  EXPECT_NEAR(shaded.sum() / plain.sum(), shaded.shading->at(plain.centre()), 1e-3);
}

}  // namespace
}  // namespace engine
