#include "engine/imaging_chain.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "engine/render/path_tracer.h"
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
               const std::vector<Material>& materials = test_support::telescope_materials())
      : pool_(threads) {
    SceneSpec scene;
    scene.epoch = flyby.epoch;
    scene.seed = 5;
    scene.sky_w_m2_sr = 5e-7;
    scene.camera = test_support::small_camera(kSide_px);
    OpticsSpec optics_spec;
    optics_spec.camera = scene.camera;
    const DetectorSpec detector;
    const double faint_w_m2 = 1.4 / detector.electrons_per_irradiance(std::chrono::milliseconds(1));
    Optics optics(optics_spec, faint_w_m2, pool_);
    RenderSpec render;
    render.camera = scene.camera;
    render.grid = optics.wish();
    auto tracer = std::make_unique<PathTracer>(render, mesh, materials, pool_);
    chain_ = std::make_unique<ImagingChain>(SnapshotBuilder(scene, flyby.camera, flyby.target),
                                            std::move(tracer), std::move(optics),
                                            Detector(detector, pool_), detector, scene.camera);
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

  Flyby flyby;

 private:
  WorkerPool pool_;
  std::unique_ptr<ImagingChain> chain_;
  TruthMask mask_{1024};
};

TEST(ImagingChain, AFrameHasTheSameBitsOnAnyNumberOfThreads) {
  Rig one(1);
  DnImage first;
  const FrameReport report = one.expose(one.shot(kClosestOfPass3_s), first);
  ASSERT_EQ(first.width(), kSide_px);
  EXPECT_GT(report.peak_dn, 20);
  for (const int threads : {1, 2, 3}) {
    Rig rig(threads);
    DnImage again;
    const FrameReport same = rig.expose(rig.shot(kClosestOfPass3_s), again);
    EXPECT_TRUE(std::ranges::equal(first.pixels(), again.pixels())) << threads;
    EXPECT_EQ(same.truth.photocentre_px.u, report.truth.photocentre_px.u);
    EXPECT_EQ(same.truth.peak_e, report.truth.peak_e);
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
    EXPECT_EQ(report.render.hits, 0U);
    EXPECT_TRUE(report.optics.window.empty());
    // .035 e- of dark current, and a sky fainter still: 14.6 e- make one DN.
    EXPECT_EQ(report.peak_dn, 0);
    EXPECT_TRUE(std::ranges::all_of(out.pixels(), [](std::uint16_t dn) { return dn == 0; }));
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

}  // namespace
}  // namespace engine
