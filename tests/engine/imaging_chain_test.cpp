#include "engine/imaging_chain.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/render_spec.h"
#include "engine/render/traced_target.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;
using test_support::kClosestOfPass3_s;

constexpr int kSide_px = 256;

/// The paper's pass with a small detector; the propagators outlive the chain.
class Rig {
 public:
  explicit Rig(int threads, const Mesh& mesh = telescope_mesh(),
               const std::vector<Material>& materials = test_support::telescope_materials(),
               bool earth_in_frame = false, std::vector<OrbitalOffset> companions = {})
      : pool_(threads) {
    SceneSpec scene;
    scene.epoch = flyby.epoch;
    scene.seed = 5;
    scene.sky_w_m2_sr = 5e-7;
    scene.camera = test_support::small_camera(kSide_px);
    scene.earth.in_frame = earth_in_frame;
    OpticsSpec optics_spec;
    optics_spec.camera = scene.camera;
    const DetectorSpec detector;
    const double faint_w_m2 = 1.4 / detector.electrons_per_irradiance(std::chrono::milliseconds(1));
    Optics optics(optics_spec, faint_w_m2, pool_);
    RenderSpec render;
    render.camera = scene.camera;
    render.grid = optics.wish();
    const auto target = std::make_shared<TracedTarget>(mesh, materials);
    std::vector<Companion> moving;
    for (const OrbitalOffset& offset : companions) {
      places_.push_back(std::make_unique<HeldOffset>(flyby.target, offset));
      moving.push_back({*places_.back(), flyby.target, {}});
    }
    auto renderer =
        make_renderer(render, target, pool_, {.companions = {companions.size(), target}});
    chain_ = std::make_unique<ImagingChain>(
        SnapshotBuilder(scene, flyby.camera, flyby.target, std::move(moving)), std::move(renderer),
        std::move(optics), Detector(detector, pool_), detector, scene.camera);
  }

  /// 1 ms, the target's apparent place `off_px` to the left of the boresight's, tracked.
  [[nodiscard]] Shot shot(double t_s, double off_px = 0.0, bool look_away = false) const {
    Shot s;
    s.sequence = 11;
    s.exposure = std::chrono::milliseconds(1);
    s.shutter_open = sim_time(t_s);
    const auto attitude = [&](Duration after) {
      const Epoch now = flyby.epoch + s.shutter_open.time_since_epoch() + after;
      const SightLine line = sight_line(flyby.camera, flyby.target, now, LightPath::kApparent);
      CameraAttitude a = look_along(line.apparent);
      if (look_away) return look_along({-line.apparent.unit});
      const double tilt = off_px * CameraGeometry{}.ifov_rad();
      const Vector3d boresight = line.apparent.unit + tilt * a.axes.matrix.row(0).transpose();
      return look_along(direction_of<J2000>(boresight));
    };
    s.attitude = {attitude(Duration{}), attitude(s.exposure / 2), attitude(s.exposure)};
    return s;
  }
  FrameReport expose(const Shot& s, DnImage& out) { return chain_->expose(s, {}, out, mask_); }
  FrameReport expose(const Shot& s, DnImage& out, TruthMask& mask) {
    return chain_->expose(s, {}, out, mask);
  }
  [[nodiscard]] const TruthMask& mask() const { return mask_; }

  Flyby flyby;

 private:
  WorkerPool pool_;
  std::vector<std::unique_ptr<HeldOffset>> places_;
  std::unique_ptr<ImagingChain> chain_;
  TruthMask mask_{1024};
};

bool same_run(const TruthMask::Run& a, const TruthMask::Run& b) {
  return a.row == b.row && a.begin == b.begin && a.end == b.end;
}

TEST(ImagingChain, AFrameHasTheSameBitsOnAnyNumberOfThreads) {
  Rig one(1);
  DnImage first;
  const FrameReport report = one.expose(one.shot(kClosestOfPass3_s), first);
  ASSERT_EQ(first.width(), kSide_px);
  EXPECT_GT(report.peak_dn, 20);
  EXPECT_EQ(report.detector.no_light_px, 0);
  for (const int threads : {1, 2, 3}) {
    Rig rig(threads);
    DnImage again;
    const FrameReport same = rig.expose(rig.shot(kClosestOfPass3_s), again);
    EXPECT_TRUE(std::ranges::equal(first.pixels(), again.pixels())) << threads;
    EXPECT_EQ(same.truth.photocentre_px.u, report.truth.photocentre_px.u);
    EXPECT_EQ(same.truth.peak_e, report.truth.peak_e);
    EXPECT_EQ(same.truth.signal_to_noise, report.truth.signal_to_noise);
    EXPECT_TRUE(std::ranges::equal(rig.mask().runs(), one.mask().runs(), same_run));
  }
}

TEST(ImagingChain, AFrameRemembersNothingOfTheOneBefore) {
  Rig rig(1);
  DnImage first;
  DnImage other;
  DnImage again;
  rig.expose(rig.shot(kClosestOfPass3_s), first);
  rig.expose(rig.shot(kClosestOfPass3_s + 8.0, 60.0), other);
  rig.expose(rig.shot(kClosestOfPass3_s), again);
  EXPECT_TRUE(std::ranges::equal(first.pixels(), again.pixels()));
  EXPECT_FALSE(std::ranges::equal(first.pixels(), other.pixels()));
}

TEST(ImagingChain, AnotherFrameNumberIsAnotherNoise) {
  Rig rig(1);
  DnImage first;
  DnImage second;
  Shot shot = rig.shot(kClosestOfPass3_s);
  rig.expose(shot, first);
  ++shot.sequence;
  rig.expose(shot, second);
  EXPECT_FALSE(std::ranges::equal(first.pixels(), second.pixels()));
}

TEST(ImagingChain, WithoutATargetThereIsSkyAndNoPhotocentre) {
  Rig rig(1);
  for (const Shot& shot :
       {rig.shot(kClosestOfPass3_s, 5000.0), rig.shot(kClosestOfPass3_s, 0.0, true)}) {
    DnImage out;
    const FrameReport report = rig.expose(shot, out);
    EXPECT_TRUE(std::isnan(report.truth.photocentre_px.u));
    EXPECT_TRUE(std::isnan(report.truth.photocentre_px.v));
    EXPECT_EQ(report.truth.peak_e, 0.0);
    EXPECT_TRUE(rig.mask().runs().empty());
    EXPECT_TRUE(report.truth.box.empty());
    EXPECT_EQ(report.truth.mask_px, 0);
    EXPECT_EQ(report.truth.signal_to_noise, 0.0);
    EXPECT_EQ(report.truth.visible_fraction, 0.0);
    EXPECT_EQ(report.render.hits, 0U);
    EXPECT_TRUE(report.optics.window.empty());
    // .035 e- of dark current, and a sky fainter still: 14.6 e- make one DN.
    EXPECT_EQ(report.peak_dn, 0);
    EXPECT_TRUE(std::ranges::all_of(out.pixels(), [](std::uint16_t dn) { return dn == 0; }));
  }
}

TEST(ImagingChain, ATargetBesideTheFrameIsNoTarget) {
  // As far out as light is followed, and further.
  Rig rig(1);
  for (const double off_px : {-900.0, -500.0, -400.0, -250.0, 250.0, 400.0, 500.0, 900.0}) {
    DnImage image;
    const FrameReport report = rig.expose(rig.shot(kClosestOfPass3_s, off_px), image);
    EXPECT_EQ(image.width(), kSide_px);
    EXPECT_EQ(report.truth.visible_fraction, 0.0) << off_px;
  }
}

TEST(ImagingChain, PhotocentreOfABallUnderTheSunFollowsItsPlace) {
  // A ball's light lies off its centre towards the Sun, the same for each place in the frame.
  const Mesh ball = test_support::sphere(1.0F, 24, 48, "white");
  Rig rig(1, ball, {test_support::lambert_material("white", 0.3)});
  DnImage out;
  const double t_s = kClosestOfPass3_s + 8.0;
  const FrameReport centred = rig.expose(rig.shot(t_s), out);
  const FrameReport moved = rig.expose(rig.shot(t_s, 40.0), out);
  EXPECT_NEAR(centred.truth.target_px.u, kSide_px / 2.0, 1e-6);
  // A pixel's tilt is its tangent: (40 px)^3 of 1e-12 are nothing.
  EXPECT_NEAR(moved.truth.target_px.u, kSide_px / 2.0 - 40.0, 1e-3);
  ASSERT_FALSE(std::isnan(centred.truth.photocentre_px.u));
  // A radius of 1 m is 6 px here; fifty samples a pixel leave .02.
  EXPECT_LT(std::hypot(centred.truth.photocentre_px.u - kSide_px / 2.0,
                       centred.truth.photocentre_px.v - kSide_px / 2.0),
            10.0);
  EXPECT_NEAR(moved.truth.photocentre_px.u - centred.truth.photocentre_px.u, -40.0, 0.05);
  EXPECT_NEAR(moved.truth.photocentre_px.v - centred.truth.photocentre_px.v, 0.0, 0.05);
}

TEST(ImagingChain, ACompanionBesideTheTargetDoesNotChangeItsTruth) {
  // 30 pixels across: less is drawn from its light as a whole when it is alone.
  const Mesh ball = test_support::sphere(1.5F, 24, 48, "white");
  const std::vector<Material> dark{test_support::lambert_material("white", 0.03)};
  for (const bool earth : {false, true}) {
    Rig alone(1, ball, dark, earth);
    // 7 m to a side and 5.5 m up: some 70 pixels away, out of each other's light.
    Rig both(1, ball, dark, earth, {{5.5, 0.0, 7.0}});
    DnImage image;
    DnImage with;
    const FrameTruth want = alone.expose(alone.shot(kClosestOfPass3_s), image).truth;
    const FrameTruth truth = both.expose(both.shot(kClosestOfPass3_s), with).truth;
    // But for the light that the balls send each other: 1/35 of the sky, times .03.
    EXPECT_NEAR(truth.photocentre_px.u, want.photocentre_px.u, 5e-3);
    EXPECT_NEAR(truth.photocentre_px.v, want.photocentre_px.v, 5e-3);
    EXPECT_NEAR(truth.peak_e / want.peak_e, 1.0, 5e-4);
    EXPECT_NEAR(truth.mask_px, want.mask_px, 2);
    EXPECT_EQ(truth.box.left, want.box.left);
    EXPECT_EQ(truth.box.bottom, want.box.bottom);
    EXPECT_NEAR(truth.signal_to_noise / want.signal_to_noise, 1.0, 1e-3);
    // And the other ball is where the truth says it is.
    ASSERT_EQ(truth.companions, 1U);
    const CompanionTruth& other = truth.companion[0];
    EXPECT_GT(
        std::hypot(other.target_px.u - truth.target_px.u, other.target_px.v - truth.target_px.v),
        30.0);
    EXPECT_NEAR(other.range_m, truth.range_m, 10.0);
    EXPECT_EQ(other.visible_fraction, 1.0);
    const auto dn = [](const DnImage& i, const PixelPoint& p) {
      int brightest = 0;
      for (int v = -14; v <= 14; ++v)
        for (int u = -14; u <= 14; ++u)
          brightest = std::max(brightest, static_cast<int>(i.at(static_cast<int>(p.u) + u,
                                                                static_cast<int>(p.v) + v)));
      return brightest;
    };
    if (earth) continue;
    EXPECT_GT(dn(with, other.target_px), 10);
    EXPECT_LT(dn(image, other.target_px), 5);
  }
}

TEST(ImagingChain, TruthIsThatOfTheSnapshot) {
  Rig rig(1);
  DnImage out;
  const FrameReport report = rig.expose(rig.shot(kClosestOfPass3_s), out);
  const Epoch middle = rig.flyby.at(kClosestOfPass3_s + 0.5e-3);
  const SightLine line =
      sight_line(rig.flyby.camera, rig.flyby.target, middle, LightPath::kApparent);
  EXPECT_DOUBLE_EQ(report.truth.range_m, line.range_m);
  EXPECT_DOUBLE_EQ(report.truth.line_of_sight_rate_rad_s, line.rate_rad_s);
  EXPECT_GT(report.truth.sun_irradiance_w_m2, 600.0);
  EXPECT_NEAR(report.truth.smear_px, 0.0, 1e-6);
  EXPECT_EQ(report.render.rejected_rays, 0U);
  EXPECT_EQ(report.peak_dn, *std::max_element(out.pixels().begin(), out.pixels().end()));
  EXPECT_EQ(report.times.render, Duration{});  // no stopwatch, no time
}

TEST(ImagingChain, BoxAndAreaAreThoseOfTheMask) {
  Rig rig(1);
  DnImage out;
  for (const double off_px : {0.0, 100.0}) {  // whole, and cut by the frame's edge
    const FrameTruth truth = rig.expose(rig.shot(kClosestOfPass3_s, off_px), out).truth;
    ASSERT_FALSE(rig.mask().truncated());
    ASSERT_FALSE(rig.mask().runs().empty());
    PixelRect box{kSide_px, kSide_px, 0, 0};
    int pixels = 0;
    TruthMask::Run last{0, 0, 0};
    for (const TruthMask::Run& run : rig.mask().runs()) {
      ASSERT_LT(run.begin, run.end);
      // In order, with a dark pixel between two runs of a row.
      ASSERT_TRUE(run.row > last.row || run.begin > last.end || pixels == 0);
      last = run;
      pixels += run.end - run.begin;
      box = {std::min<int>(box.left, run.begin), std::min<int>(box.top, run.row),
             std::max<int>(box.right, run.end), std::max<int>(box.bottom, run.row + 1)};
    }
    EXPECT_EQ(truth.mask_px, pixels);
    EXPECT_EQ(truth.box.left, box.left);
    EXPECT_EQ(truth.box.top, box.top);
    EXPECT_EQ(truth.box.right, box.right);
    EXPECT_EQ(truth.box.bottom, box.bottom);
    EXPECT_EQ(box.left == 0, off_px > 0.0);
    EXPECT_GT(truth.signal_to_noise, 100.0);
  }
}

TEST(ImagingChain, AMaskWithoutRoomSaysSoAndTheFiguresStayWhole) {
  Rig rig(1);
  DnImage out;
  const Shot shot = rig.shot(kClosestOfPass3_s);
  const FrameTruth whole = rig.expose(shot, out).truth;
  TruthMask small(3);
  const FrameTruth cut = rig.expose(shot, out, small).truth;
  EXPECT_TRUE(small.truncated());
  EXPECT_EQ(small.runs().size(), 3U);
  EXPECT_EQ(cut.mask_px, whole.mask_px);
  EXPECT_EQ(cut.box.bottom, whole.box.bottom);
  EXPECT_EQ(cut.signal_to_noise, whole.signal_to_noise);
}

TEST(ImagingChain, HalfOfABallOnTheEdgeOfTheFrameIsVisible) {
  const Mesh ball = test_support::sphere(1.0F, 24, 48, "white");
  Rig rig(1, ball, {test_support::lambert_material("white", 0.3)});
  DnImage out;
  const double t_s = kClosestOfPass3_s + 8.0;
  EXPECT_EQ(rig.expose(rig.shot(t_s), out).truth.visible_fraction, 1.0);
  // The edge is half a pixel beyond the centre of pixel 0. The mesh is its own mirror image, so the
  // halves are equal but for the tilt's tangent: .03 px of a ball of 12.
  const FrameTruth half = rig.expose(rig.shot(t_s, kSide_px / 2.0 + 0.5), out).truth;
  EXPECT_NEAR(half.visible_fraction, 0.5, 3e-3);
}

TEST(ImagingChain, TheEarthBehindBringsItsLightAndItsShotNoise) {
  Rig rig(1, telescope_mesh(), test_support::telescope_materials(), true);
  DnImage out;
  rig.expose(rig.shot(kClosestOfPass3_s, 5000.0), out);  // no target
  // The Earth as the snapshot has it, pixel by pixel.
  SceneSpec scene;
  scene.epoch = rig.flyby.epoch;
  scene.camera = test_support::small_camera(kSide_px);
  const Snapshot s = SnapshotBuilder(scene, rig.flyby.camera, rig.flyby.target)
                         .build(rig.shot(kClosestOfPass3_s, 5000.0));
  EarthBackground background;
  background.reserve(scene.camera, 0);
  background.draw(s.earth_in_frame, 0.0);
  WorkerPool pool(1);
  OpticsSpec optics_spec;
  optics_spec.camera = scene.camera;
  const DetectorSpec detector;
  const double e_per_radiance = Optics(optics_spec, 1.0, pool).throughput_sr() *
                                detector.electrons_per_irradiance(std::chrono::milliseconds(1));
  double squares = 0;
  double sum = 0;
  for (int v = 0; v < kSide_px; ++v) {
    for (int u = 0; u < kSide_px; ++u) {
      const double mean_e = background.at({1.0 * u, 1.0 * v}) * e_per_radiance;
      EXPECT_GT(mean_e, 500.0);
      // The quantiser rounds down: half a DN.
      const double off_e = (out.at(u, v) + 0.5) * detector.gain_e_dn() - mean_e;
      sum += off_e / detector.noise_e(mean_e);
      squares += std::pow(off_e / detector.noise_e(mean_e), 2);
    }
  }
  const double pixels = 1.0 * kSide_px * kSide_px;
  EXPECT_NEAR(sum / pixels, 0.0, 5.0 / std::sqrt(pixels));
  EXPECT_NEAR(squares / pixels, 1.0, 5.0 * std::sqrt(2.0 / pixels));
}

TEST(ImagingChain, ADarkBallBeforeTheEarthIsAHoleOfItsOwnSize) {
  const Mesh ball = test_support::sphere(4.0F, 24, 48, "black");
  const std::vector<Material> black = {test_support::lambert_material("black", 0.03)};
  Rig space(1, ball, black, false);
  Rig earth(1, ball, black, true);
  DnImage out;
  const Shot shot = earth.shot(kClosestOfPass3_s);
  const FrameTruth alone = space.expose(shot, out).truth;
  const FrameTruth truth = earth.expose(shot, out).truth;
  // 4 m at 69 km are 40.2 px; the mask goes as far as what is missing is above the noise, some
  // pixels further. A mesh of 24 rings is up to 1 % smaller.
  const double across_px = 8.0 / alone.range_m / CameraGeometry{}.ifov_rad();
  EXPECT_NEAR(truth.box.width(), across_px, 8.0);
  EXPECT_GE(truth.mask_px, 0.9 * kPi / 4.0 * across_px * across_px);
  EXPECT_LE(truth.mask_px, 1.3 * kPi / 4.0 * across_px * across_px);
  EXPECT_LT(out.at(kSide_px / 2 + 30, kSide_px / 2) + 20, out.at(10, 10));
  EXPECT_GT(truth.signal_to_noise, 100.0);
  // Its own light is where it was. Blurred, up to a hundredth of it leaves the window, more on the
  // side that is nearer: the window's middle draws what is left.
  const PixelPoint off{alone.photocentre_px.u - kSide_px / 2.0,
                       alone.photocentre_px.v - kSide_px / 2.0};
  EXPECT_GT(std::hypot(off.u, off.v), 10.0);
  EXPECT_NEAR(truth.photocentre_px.u, alone.photocentre_px.u, 0.01 * std::abs(off.u));
  EXPECT_NEAR(truth.photocentre_px.v, alone.photocentre_px.v, 0.01 * std::abs(off.v));
}

TEST(ImagingChain, AFarTargetBeforeTheEarthHasThePhotocentreThatItHasAlone) {
  // Ten centimetres at 69 km are one pixel: points of light, and nothing on the grid.
  const Mesh ball = test_support::sphere(0.05F, 24, 48, "white");
  const std::vector<Material> white = {test_support::lambert_material("white", 0.9)};
  Rig space(1, ball, white, false);
  Rig earth(1, ball, white, true);
  DnImage out;
  const Shot shot = earth.shot(kClosestOfPass3_s, 40.0);
  const FrameReport alone = space.expose(shot, out);
  const FrameReport before = earth.expose(shot, out);
  ASSERT_GT(alone.truth.peak_e, 100.0);
  const auto is_far = [](const Rung& rung) {
    return rung.ladder == "target" && (rung.taken == "moments" || rung.taken == "point");
  };
  EXPECT_TRUE(std::ranges::any_of(alone.render.rungs, is_far));
  EXPECT_TRUE(std::ranges::any_of(before.render.rungs, is_far));
  EXPECT_DOUBLE_EQ(before.truth.visible_fraction, alone.truth.visible_fraction);
  // Alone it is that of the blurred light, a part of which leaves the window.
  EXPECT_NEAR(before.truth.photocentre_px.u, alone.truth.photocentre_px.u, 0.5);
  EXPECT_NEAR(before.truth.photocentre_px.v, alone.truth.photocentre_px.v, 0.5);
  EXPECT_GT(std::abs(before.truth.photocentre_px.u - kSide_px / 2.0), 30.0);
}

/// The same radiance wherever light can come from, or a square of it in the middle.
class Patch final : public Renderer {
 public:
  Patch(double radiance_w_m2_sr, const PixelRect& region)
      : radiance_w_m2_sr_(radiance_w_m2_sr), region_(region) {}
  RenderReport render(const Snapshot& /*snapshot*/, Budget /*budget*/,
                      Radiance& out) noexcept override {
    out.region = region_;
    out.oversampling = 3;
    out.grid.resize(region_.width() * 3, region_.height() * 3);
    std::ranges::fill(out.grid.pixels(), static_cast<float>(radiance_w_m2_sr_));
    out.uniform_w_m2_sr = 0;
    return {};
  }

 private:
  double radiance_w_m2_sr_;
  PixelRect region_;
};

struct Seen {
  FrameTruth truth;
  std::size_t runs = 0;
  double noise_e = 0;
};

/// A patch that brings `light_e` to each pixel in a millisecond, exposed for `exposure`.
Seen see_patch(double light_e, bool fills_frame, Duration exposure) {
  const Flyby flyby;
  WorkerPool pool(1);
  SceneSpec scene;
  scene.epoch = flyby.epoch;
  scene.camera = test_support::small_camera(64);
  scene.earth.in_frame = false;
  OpticsSpec optics_spec;
  optics_spec.camera = scene.camera;
  const DetectorSpec detector;
  const double to_e = detector.electrons_per_irradiance(std::chrono::milliseconds(1));
  Optics optics(optics_spec, 1e-3 * light_e / to_e, pool);
  const double radiance = light_e / to_e / optics.throughput_sr();
  const PixelRect region =
      fills_frame ? scene.camera.frame().grown_by(64) : scene.camera.frame().grown_by(-24);
  ImagingChain chain(SnapshotBuilder(scene, flyby.camera, flyby.target),
                     std::make_unique<Patch>(radiance, region), std::move(optics),
                     Detector(detector, pool), detector, scene.camera);
  Shot shot;
  shot.exposure = exposure;
  shot.shutter_open = sim_time(kClosestOfPass3_s);
  DnImage out;
  TruthMask mask(1024);
  Seen seen;
  seen.truth = chain.expose(shot, {}, out, mask).truth;
  seen.runs = mask.runs().size();
  seen.noise_e = detector.noise_e(detector.dark_e_s * seconds(exposure));
  return seen;
}

TEST(ImagingChain, SignalToNoiseOfAUniformFieldIsTheClosedForm) {
  for (const double light_e : {6.0, 100.0, 5000.0}) {
    SCOPED_TRACE(light_e);
    const Seen seen = see_patch(light_e, true, std::chrono::milliseconds(1));
    EXPECT_EQ(seen.truth.mask_px, 64 * 64);
    EXPECT_EQ(seen.runs, 64U);
    EXPECT_EQ(seen.truth.box.right, 64);
    // n e / sqrt(n e + n s^2). The wings that are cut off at 64 px hold .3 % of the light.
    const double expected = 64.0 * light_e / std::sqrt(light_e + seen.noise_e * seen.noise_e);
    EXPECT_NEAR(seen.truth.signal_to_noise / expected, 1.0, 5e-3);
  }
  // 4.7 e- of noise: a field fainter than that is not there.
  const Seen faint = see_patch(4.0, true, std::chrono::milliseconds(1));
  EXPECT_GT(faint.noise_e, 4.5);
  EXPECT_EQ(faint.truth.mask_px, 0);
  EXPECT_EQ(faint.truth.signal_to_noise, 0.0);
}

TEST(ImagingChain, MaskGrowsWithTheExposureAsTheWingsOfLightRiseOverTheNoise) {
  int last_px = 0;
  for (const int ms : {1, 4, 16, 64}) {
    const Seen seen = see_patch(100.0, false, std::chrono::milliseconds(ms));
    EXPECT_GT(seen.truth.mask_px, last_px) << ms;
    EXPECT_GE(seen.truth.mask_px, 16 * 16);
    last_px = seen.truth.mask_px;
  }
}

}  // namespace
}  // namespace engine
