#include "engine/optics/point_splat.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/exact_spread.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::ExactSpread;

constexpr int kSide_px = 256;
constexpr double kFollowAll_w_m2 = 1e-30;  // of faint light

OpticsSpec spec_of(double aperture_m = 0.36, double obscuration = 0.0) {
  OpticsSpec spec;
  spec.camera = test_support::small_camera(kSide_px);
  spec.lens.aperture_m = aperture_m;
  spec.lens.obscuration = obscuration;
  return spec;
}

struct Picture {
  IrradianceImage image;
  PointSplat::Report report;

  [[nodiscard]] double at(int u, int v) const { return static_cast<double>(image.at(u, v)); }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const float x : image.pixels()) total += static_cast<double>(x);
    return total;
  }
  [[nodiscard]] double highest() const {
    return static_cast<double>(*std::ranges::max_element(image.pixels()));
  }
};

Picture splat(const std::vector<PointSource>& points, const OpticsSpec& spec = spec_of(),
              int threads = 1, double faint_w_m2 = kFollowAll_w_m2) {
  WorkerPool pool(threads);
  PointSplat splat(spec, OtfCascade(spec), faint_w_m2, pool);
  Picture out;
  out.image.resize(spec.camera.width_px, spec.camera.height_px);
  out.report = splat.add(points, {}, out.image);
  return out;
}

/// The same point without a table, within 32 px of its place; elsewhere 0.
Picture exact(const PointSource& point, const ExactSpread& spread = ExactSpread(spec_of()),
              const OpticsSpec& spec = spec_of(), int half_px = 32) {
  const double light = throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2);
  const int left = static_cast<int>(std::lround(point.place.u)) - half_px;
  const int top = static_cast<int>(std::lround(point.place.v)) - half_px;
  const int side = 2 * half_px + 1;
  const Eigen::MatrixXd shares = spread.image(point.place, left, top, side, side, point.motion_px);
  Picture out;
  out.image.resize(spec.camera.width_px, spec.camera.height_px);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      out.image.at(left + x, top + y) =
          static_cast<float>(light * point.irradiance_w_m2 * shares(y, x));
  return out;
}

/// Where `b` is known.
double largest_difference(const Picture& a, const Picture& b) {
  double most = 0;
  for (int v = 0; v < a.image.height(); ++v)
    for (int u = 0; u < a.image.width(); ++u)
      if (b.at(u, v) != 0.0) most = std::max(most, std::abs(a.at(u, v) - b.at(u, v)));
  return most;
}

PixelPoint centroid(const Picture& p, int u, int v, int half) {
  double sum = 0;
  PixelPoint at;
  for (int y = v - half; y <= v + half; ++y) {
    for (int x = u - half; x <= u + half; ++x) {
      sum += p.at(x, y);
      at.u += p.at(x, y) * x;
      at.v += p.at(x, y) * y;
    }
  }
  return {at.u / sum, at.v / sum};
}

TEST(PointSplat, ImageAndCentroidAreThoseOfTheTransformAtEveryPhase) {
  // .467 m is as much as three cells to a pixel carry, and the hardest to interpolate.
  for (const auto& spec : {spec_of(), spec_of(0.467), spec_of(0.36, 0.4)}) {
    const ExactSpread spread(spec);
    WorkerPool pool(1);
    PointSplat table(spec, OtfCascade(spec), kFollowAll_w_m2, pool);
    for (int i = 0; i <= 40; ++i) {
      const PointSource star{{128.0 + i / 40.0, 127.3 - i / 17.0}, 1.0, {}};
      Picture got;
      got.image.resize(kSide_px, kSide_px);
      table.add(std::span(&star, 1), {}, got.image);
      const Picture want = exact(star, spread, spec);
      const double error = largest_difference(got, want) / want.highest();
      EXPECT_LT(error, 1e-4) << spec.lens.aperture_m << ", phase " << i;
      const int u = static_cast<int>(std::lround(star.place.u));
      const int v = static_cast<int>(std::lround(star.place.v));
      EXPECT_NEAR(centroid(got, u, v, 8).u, centroid(want, u, v, 8).u, 1e-3) << i;
      EXPECT_NEAR(centroid(got, u, v, 8).v, centroid(want, u, v, 8).v, 1e-3) << i;
    }
  }
}

TEST(PointSplat, LightIsInTheImageOrReportedAsLost) {
  const OpticsSpec spec = spec_of();
  const double flux = throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2);
  for (const double faint_w_m2 : {kFollowAll_w_m2, 1e-5 * flux, 1e-4 * flux}) {
    const Picture p = splat({{{128.2, 127.9}, 1.0, {}}}, spec, 1, faint_w_m2);
    // Where the wings end, a square or a circle, is worth a fifth of them at most: the corners of a
    // square are 27 % more area, of which the law gives its share.
    const double lost = p.report.lost_flux_share;
    EXPECT_NEAR(p.sum() / flux + lost, 1.0, 0.2 * lost + 1e-3) << faint_w_m2;
    EXPECT_GT(lost, 0.0);
  }
}

TEST(PointSplat, WingsCarryOnWhereTheTableEnds) {
  const Picture p = splat({{{128.0, 128.0}, 1.0, {}}});
  const Picture want = exact({{128.0, 128.0}, 1.0, {}}, ExactSpread(spec_of()), spec_of(), 60);
  // Averaged over 16 px along an axis the rings are all but gone; the transform's image repeats
  // after 512 px, which adds (40 / 472)^3 = 0.06 % at the far end.
  double got_sum = 0;
  double want_sum = 0;
  for (int u = 128 + PointSplat::kCore_px + 1; u < 128 + PointSplat::kCore_px + 17; ++u) {
    got_sum += p.at(u, 128);
    want_sum += want.at(u, 128);
  }
  EXPECT_NEAR(got_sum / want_sum, 1.0, 0.02);
}

TEST(PointSplat, AStreakIsTheTransformsSmear) {
  for (const PixelPoint motion : {PixelPoint{0.5, 0.0}, {3.0, 0.0}, {-2.0, 5.3}, {31.0, -17.0}}) {
    const PointSource star{{126.4, 131.1}, 1.0, motion};
    const Picture want = exact(star);
    EXPECT_LT(largest_difference(splat({star}), want) / want.highest(), 1e-3)
        << motion.u << ", " << motion.v;
  }
}

TEST(PointSplat, AStreakKeepsItsLight) {
  const double still = splat({{{128.0, 128.0}, 1.0, {}}}).sum();
  for (const double length : {0.5, 3.0, 60.0}) {
    // The image's float has 24 bits; some 4000 pixels get up to 600 additions each.
    EXPECT_NEAR(splat({{{128.0, 128.0}, 1.0, {0.6 * length, 0.8 * length}}}).sum() / still, 1.0,
                2e-3)
        << length;
  }
  // Twice as long as the frame is wide: the half that lies in it.
  const double inside = splat({{{127.5, 127.5}, 1.0, {2.0 * kSide_px, 0.0}}}).sum();
  EXPECT_NEAR(inside / still, 0.5, 2e-3);
}

TEST(PointSplat, AStreakOfAMillionPixelsCostsNoMoreThanTheFrame) {
  const Picture p = splat({{{128.0, 128.0}, 1.0, {1e6, 1e6}}});
  // Three images to a pixel of the frame's diagonal with its margins, in each of four bands.
  EXPECT_LT(p.report.footprints, 4 * 3 * 2 * (kSide_px + 4 * 64));
  EXPECT_GT(p.report.footprints, 3 * kSide_px);
}

TEST(PointSplat, WhatLiesOutsideTheFrameShinesInAsIfTheFrameWereLarger) {
  const Picture outside = splat({{{-3.3, 100.2}, 1.0, {2.0, -7.0}}});
  const Picture inside = splat({{{96.7, 100.2}, 1.0, {2.0, -7.0}}});
  double most = 0;
  for (int v = 0; v < kSide_px; ++v)
    for (int u = 0; u < kSide_px - 100; ++u)
      most = std::max(most, std::abs(outside.at(u, v) - inside.at(u + 100, v)));
  // The place's fraction is rounded 2^-46 px off at most; of float's 24 bits a few are lost.
  EXPECT_LT(most, 1e-5 * inside.highest());
  EXPECT_GT(outside.highest(), 1e-3 * inside.highest());
}

TEST(PointSplat, SameBitsOnAnyNumberOfThreads) {
  std::vector<PointSource> points;
  for (int i = 0; i < 500; ++i)
    points.push_back({{std::fmod(i * 37.31, 260.0), std::fmod(i * 91.7, 260.0)},
                      1.0 + i % 7,
                      {0.01 * i, 3.0 - 0.02 * i}});
  const Picture one = splat(points, spec_of(), 1, 1e3);
  EXPECT_GT(one.highest(), 0.0);
  for (const int threads : {2, 3}) {
    const Picture more = splat(points, spec_of(), threads, 1e3);
    EXPECT_TRUE(std::ranges::equal(one.image.pixels(), more.image.pixels())) << threads;
    EXPECT_EQ(one.report.footprints, more.report.footprints);
  }
}

TEST(PointSplat, NoPointsChangeNothing) {
  WorkerPool pool(1);
  PointSplat splat(spec_of(), OtfCascade(spec_of()), kFollowAll_w_m2, pool);
  IrradianceImage image(kSide_px, kSide_px);
  std::ranges::fill(image.pixels(), 0.25F);
  EXPECT_EQ(splat.add({}, {}, image).footprints, 0U);
  EXPECT_TRUE(std::ranges::all_of(image.pixels(), [](float x) { return x == 0.25F; }));
}

}  // namespace
}  // namespace engine
