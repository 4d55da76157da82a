// How Optics spreads light: where the fine grid ends and the far wings begin, long smears, glints,
// and what is out of focus. Throughput, places and laws of the small: optics_test.cpp.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/optics/optics.h"
#include "tests/support/exact_spread.h"
#include "tests/support/projected.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::ExactSpread;
using test_support::project;
using test_support::Projected;
using test_support::small_camera;

constexpr int kSide_px = 512;

OpticsSpec spec_of(int side_px = kSide_px) {
  OpticsSpec spec;
  spec.camera = small_camera(side_px);
  return spec;
}

Radiance dark_over(PixelRect region) {
  Radiance in;
  in.region = region;
  in.grid.resize(3 * region.width(), 3 * region.height());
  std::ranges::fill(in.grid.pixels(), 0.0F);
  return in;
}

/// A disc with dark patches: edges everywhere.
Radiance patched_disc(int across_px, int middle_px) {
  const int corner = middle_px - across_px / 2;
  Radiance in = dark_over({corner, corner, corner + across_px, corner + across_px});
  const double half = 1.5 * across_px;
  for (int y = 0; y < in.grid.height(); ++y)
    for (int x = 0; x < in.grid.width(); ++x)
      if (std::hypot(x - half, y - half) < half && (x / 40 + y / 33) % 3 != 0)
        in.grid.at(x, y) = 1.0F;
  return in;
}

TEST(OpticsSpread, WingsOnTheirOwnGridAreThoseOfTheFineOne) {
  // The paper's camera and sensor: radiance 1 is 15 000 e-, faint is three tenths of 4.7 e-.
  const double e = throughput_sr(spec_of()) / 15000.0;
  const Radiance in = patched_disc(40, 256);
  OpticsSpec spec = spec_of();
  spec.largest_wing_px = 64;
  const Projected fine = project(in, spec, 1e-6 * e);
  const Projected split = project(in, spec, 0.3 * 4.7 * e);
  EXPECT_EQ(fine.report.core_px, 64);
  EXPECT_EQ(split.report.core_px, 16);
  // As far as 32 px from it: further out the fine grid's own copies, 168 px apart, show.
  double sigmas = 0;
  for (int v = 256 - 52; v < 256 + 52; ++v)
    for (int u = 256 - 52; u < 256 + 52; ++u)
      sigmas = std::max(sigmas, std::abs(fine.at(u, v) - split.at(u, v)) / e /
                                    std::sqrt(std::max(fine.at(u, v) / e, 0.0) + 22.0));
  // Convolution's share of what the default profile loses in noise, sqrt(.2 x .1) sigma.
  EXPECT_LT(sigmas, 0.14);
}

TEST(OpticsSpread, ALongSmearIsTheMeanOfStillImages) {
  const OpticsSpec spec = spec_of();
  const double e = throughput_sr(spec) / 15000.0;
  const Projected still = project(patched_disc(40, 200), spec, 0.01 * e);
  for (const int length_px : {50, 200}) {
    Radiance in = patched_disc(40, 200 + length_px / 2);
    in.motion_px = {1.0 * length_px, 0.0};
    const Projected out = project(in, spec, 0.01 * e);
    EXPECT_GT(out.report.segments, 1);
    double worst = 0;
    for (int u = 30; u < 480; ++u) {
      double mean = 0;  // trapezium: whole pixels, the ends half
      for (int k = 0; k <= length_px; ++k) {
        const int from = u - k;
        if (from >= 0)
          mean += still.at(from, 200 + length_px / 2 - length_px / 2) *
                  (k == 0 || k == length_px ? 0.5 : 1.0) / length_px;
      }
      worst = std::max(worst, std::abs(out.at(u, 200 + length_px / 2) - mean));
    }
    // Waves of one cycle per pixel and more, which whole pixels do not see, are 1e-4 of an edge.
    EXPECT_LT(worst, 2e-3 * throughput_sr(spec) * 40.0 / length_px) << length_px;
    EXPECT_NEAR(out.sum() / still.sum(), 1.0, 2e-3) << length_px;
  }
}

TEST(OpticsSpread, AStreakLongerThanTheFrameLeavesItsShareInIt) {
  const OpticsSpec spec = spec_of();
  const double e = throughput_sr(spec) / 15000.0;
  const Projected still = project(patched_disc(20, 256), spec, 1e-3 * e);
  Radiance in = patched_disc(20, 256);
  in.motion_px = {5.0 * kSide_px, 0.0};
  EXPECT_NEAR(project(in, spec, 1e-3 * e).sum() / still.sum(), 0.2, 1e-3);
  // Along a diagonal, and so far that next to nothing is left.
  in.motion_px = {3e5, -3e5};
  EXPECT_NEAR(project(in, spec, 1e-3 * e).sum() / still.sum(), 512.0 / 3e5, 1e-4);
  in.motion_px = {1e300, 0.0};
  EXPECT_EQ(project(in, spec, 1e-3 * e).sum(), 0.0);
}

TEST(OpticsSpread, AGlintsRoundingIsNotSeenInTheDark) {
  // A12.6: 1e9 e- in one cell of a region that reaches 500 px further.
  OpticsSpec spec = spec_of(640);
  spec.largest_wing_px = 512;
  const double e = throughput_sr(spec) / 15000.0;  // the irradiance of one electron
  Radiance in = dark_over({40, 300, 600, 330});
  in.grid.at(3 * 20 + 1, 3 * 15 + 1) = static_cast<float>(9.0 * 1e9 / 15000.0);
  const Projected out = project(in, spec, 0.1 * e);
  EXPECT_EQ(out.report.points, 1);
  // The mean of the wing, and its copies 1600 px to the side and 1080 px above and below: beyond
  // the circle of that area 2 pi .0403 / (741 px 1.73e6 px^2) of the light, .2 e-. A transform of
  // it all would leave 100 e- of rounding.
  const auto wing_e = [](double r) { return 0.0403 * 1e9 / std::pow(r, 3); };
  EXPECT_NEAR(out.at(60 + 500, 315) / e, wing_e(500.0) + 0.2, 0.1);
  EXPECT_NEAR(out.at(60 + 300, 315) / e, wing_e(300.0) + 0.2, 0.1);
}

TEST(OpticsSpread, ABrightCellIsSpreadAsADimOneIs) {
  // Just under and over the limit, at all places of a cell in its pixel.
  const OpticsSpec spec = spec_of(256);
  const double e = throughput_sr(spec) / 15000.0;
  for (const int cell : {0, 1, 2}) {
    Radiance in = dark_over({120, 120, 136, 136});
    float& bright = in.grid.at(24 + cell, 24 - cell);
    const double limit = 1e6 * 0.3 * 4.7 * 9.0 / 15000.0;
    bright = static_cast<float>(0.999 * limit);
    const Projected dim = project(in, spec, 0.3 * 4.7 * e);
    bright = static_cast<float>(1.001 * limit);
    const Projected glint = project(in, spec, 0.3 * 4.7 * e);
    EXPECT_EQ(dim.report.points, 0);
    EXPECT_EQ(glint.report.points, 1);
    double worst = 0;
    double peak = 0;
    for (int v = 90; v < 166; ++v) {
      for (int u = 90; u < 166; ++u) {
        peak = std::max(peak, dim.at(u, v));
        worst = std::max(worst, std::abs(glint.at(u, v) / 1.002 - dim.at(u, v)));
      }
    }
    EXPECT_LT(worst, 1e-3 * peak) << cell;
  }
}

TEST(OpticsSpread, ABrightCellKeepsItsLightHoweverTheLensBlurs) {
  // Wings that others were to spread must have been spread: they are 6 % of it.
  OpticsSpec shaken = spec_of(256);
  shaken.jitter_rad = 3.0 * shaken.camera.ifov_rad();
  OpticsSpec spider = spec_of(256);
  spider.lens.spider_vanes = 4;
  spider.lens.spider_width_m = 5e-3;
  for (const OpticsSpec& spec : {spec_of(256), shaken, spider}) {
    const double e = throughput_sr(spec) / 15000.0;
    Radiance in = dark_over({120, 120, 136, 136});
    const double cell_e = 2.0 * 1e6 * 0.3 * 4.7;
    in.grid.at(24, 24) = static_cast<float>(cell_e * 9.0 / 15000.0);
    const Projected out = project(in, spec, 0.3 * 4.7 * e);
    // What lies further than the light is followed, and what the frame's edge cuts off besides.
    EXPECT_NEAR(out.sum() / e / cell_e, 1.0, out.report.lost_flux_share + 0.003)
        << spec.jitter_rad << " " << spec.lens.spider_vanes;
    EXPECT_LE(out.report.core_px, out.report.wing_px);
  }
}

TEST(OpticsSpread, ACellThatIsNoNumberCostsItsOwnLightOnly) {
  const OpticsSpec spec = spec_of(256);
  const double e = throughput_sr(spec) / 15000.0;
  Radiance in = patched_disc(40, 128);
  in.grid.at(50, 50) = 0.0F;
  in.grid.at(51, 50) = 0.0F;
  const Projected want = project(in, spec, e);
  in.grid.at(50, 50) = std::numeric_limits<float>::quiet_NaN();
  in.grid.at(51, 50) = std::numeric_limits<float>::infinity();
  const Projected got = project(in, spec, e);
  EXPECT_TRUE(std::ranges::equal(want.image.pixels(), got.image.pixels()));
  // Nor does a motion that is none: the target is gone, the frame is whole.
  in.motion_px = {1.0, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(project(in, spec, e).sum(), 0.0);
}

TEST(OpticsSpread, WhatIsBeyondTheFocusIsAsBlurredAsWhatIsNearer) {
  // 1/Z - 1/Zf of the same size either way.
  OpticsSpec spec = spec_of(256);
  spec.focus = Focus::kDistance;
  spec.focus_range_m = 100e3;
  const auto peak = [&](double range_m) {
    Radiance in = dark_over({128, 128, 129, 129});
    in.range_m = range_m;
    in.points.push_back({{128.0, 128.0}, 1.0, {}});
    return project(in, spec, 1e-7 * throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2))
        .highest();
  };
  const double sharp = peak(100e3);
  const double beyond = peak(300e3);
  EXPECT_LT(beyond, 0.93 * sharp);
  // Blended from other levels on either side: 3e-3 of the light (PointSplat), its peak a third.
  EXPECT_NEAR(beyond / peak(60e3), 1.0, 0.01);
}

TEST(OpticsSpread, OutOfFocusIsTheExactImageOfItsRange) {
  OpticsSpec spec = spec_of(256);
  spec.focus = Focus::kInfinity;
  const double light = throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2);
  WorkerPool pool(1);
  Optics optics(spec, 1e-7 * light, pool);
  for (const double range_m : {69e3, 100e3, 200e3}) {
    Radiance in = dark_over({128, 128, 129, 129});
    in.range_m = range_m;
    in.points.push_back({{128.3, 127.8}, 1.0, {}});
    Projected out;
    out.report = optics.project(in, out.image);
    const double defocus_m = spec.defocus_m(range_m, range_m);
    EXPECT_DOUBLE_EQ(out.report.defocus_m, defocus_m);
    const Eigen::MatrixXd want =
        ExactSpread(spec, defocus_m).image({128.3, 127.8}, 108, 108, 41, 41);
    double worst = 0;
    for (int y = 0; y < 41; ++y)
      for (int x = 0; x < 41; ++x)
        worst = std::max(worst, std::abs(out.at(108 + x, 108 + y) / light - want(y, x)));
    EXPECT_LT(worst, 3e-3 * want.maxCoeff()) << range_m;
  }
}

TEST(OpticsSpread, AnExtendedTargetIsAsFarOutOfFocusAsAPoint) {
  // A pixel of even light on the fine grid against the same as points on the splat's tables.
  OpticsSpec spec = spec_of(256);
  spec.focus = Focus::kInfinity;
  spec.lens.zernike_m[7] = 50e-9;  // coma: not radial, not even
  const double cell_sr = std::pow(spec.camera.ifov_rad() / 3.0, 2);
  Radiance grid = dark_over({120, 120, 136, 136});
  Radiance points = dark_over({120, 120, 136, 136});
  grid.range_m = points.range_m = 120e3;
  for (int y = 20; y < 29; ++y) {
    for (int x = 20; x < 29; ++x) {
      grid.grid.at(x, y) = 1.0F;
      if (points.points.size() < Radiance::kMostPoints && x < 28 && y < 28)
        points.points.push_back({{120.0 + (x - 1) / 3.0, 120.0 + (y - 1) / 3.0}, cell_sr, {}});
    }
  }
  for (int i = 20; i < 29; ++i) grid.grid.at(28, i) = grid.grid.at(i, 28) = 0.0F;
  WorkerPool pool(1);
  Optics optics(spec, 1e-5 * throughput_sr(spec), pool);
  Projected a;
  Projected b;
  optics.project(grid, a.image);
  optics.project(points, b.image);
  double peak = 0;
  double worst = 0;
  double shift = 0;
  for (int v = 100; v < 156; ++v) {
    for (int u = 100; u < 156; ++u) {
      peak = std::max(peak, a.at(u, v));
      worst = std::max(worst, std::abs(a.at(u, v) - b.at(u, v)));
      shift += (a.at(u, v) - b.at(u, v)) * (u - 128);
    }
  }
  // The grid takes a cell's own square back out, points have none: (1/3)^2/24 of the second
  // derivative, a hundredth at an edge this sharp.
  EXPECT_LT(worst, 0.02 * peak);
  EXPECT_NEAR(shift / a.sum(), 0.0, 0.01);
}

TEST(OpticsSpread, SpiderAndErrorsMakeNoNegativeLight) {
  OpticsSpec spec = spec_of(256);
  spec.lens.obscuration = 0.3;
  spec.lens.spider_vanes = 4;
  spec.lens.spider_width_m = 8e-3;
  spec.lens.zernike_m[5] = 60e-9;
  spec.jitter_rad = 0.4e-6;
  spec.vibration = {1.5e-6, 0.7};
  const double e = throughput_sr(spec) / 15000.0;
  const Projected out = project(patched_disc(40, 128), spec, 1e-2 * e);
  for (const float x : out.image.pixels()) ASSERT_GE(static_cast<double>(x) / e, -0.2);
  EXPECT_GT(out.sum(), 0.0);
}

/// Around a corner: to the right until mid-exposure, then down.
ImagePath corner_of(double length_px) {
  ImagePath path;
  path.bends = true;
  ImageMotion even{{length_px, length_px}, {}};
  for (int i = 0; i <= ImagePath::kSteps; ++i) {
    const double t = static_cast<double>(i) / ImagePath::kSteps;
    const PixelPoint here{std::min(2.0 * t - 1.0, 0.0) * length_px,
                          std::max(2.0 * t - 1.0, 0.0) * length_px};
    path.off_px[static_cast<std::size_t>(i)] = {here.u - even.after(i).u, here.v - even.after(i).v};
  }
  return path;
}

TEST(OpticsSpread, AnImageThatTurnsACornerIsTwoStraightSmears) {
  const OpticsSpec spec = spec_of();
  const double faint = 0.05 * throughput_sr(spec) / 15000.0;
  // Within one window, and beyond what one holds; its grid, its wings and its points.
  for (const double length_px : {4.0, 24.0, 80.0}) {
    Radiance in = patched_disc(40, 256);
    in.points = {{{251.25, 259.5}, 4e-11, {}}};
    in.motion_px = {length_px, length_px};
    in.path = corner_of(length_px);
    const Projected bent = project(in, spec, faint);
    // Each leg as a straight smear of its own, moved to where its middle is by the turn of waves.
    in.path = {};
    const auto leg = [&](PixelPoint from, PixelPoint to) {
      Radiance part = in;
      part.motion_px = {to.u - from.u, to.v - from.v};
      ImagePath& path = part.path;
      path.bends = false;
      const PixelPoint middle{0.5 * (from.u + to.u), 0.5 * (from.v + to.v)};
      EXPECT_EQ(middle.u, std::round(middle.u)) << "whole pixels";
      part.region = {in.region.left + static_cast<int>(middle.u),
                     in.region.top + static_cast<int>(middle.v),
                     in.region.right + static_cast<int>(middle.u),
                     in.region.bottom + static_cast<int>(middle.v)};
      part.points.front().place.u += middle.u;
      part.points.front().place.v += middle.v;
      return project(part, spec, faint);
    };
    const Projected across = leg({-length_px, 0.0}, {});
    const Projected down = leg({}, {0.0, length_px});
    double worst = 0;
    for (int v = 0; v < kSide_px; ++v)
      for (int u = 0; u < kSide_px; ++u)
        worst = std::max(worst, std::abs(bent.at(u, v) - 0.5 * (across.at(u, v) + down.at(u, v))));
    EXPECT_LT(worst, 2e-4 * bent.highest()) << length_px;
    EXPECT_NEAR(bent.sum() / across.sum(), 1.0, 1e-4) << length_px;
  }
}

TEST(OpticsSpread, AWholeSwingHasBesselsFunctionForItsOtf) {
  // A sine's path is J0 of its amplitude (eq 18), but for what sixteen straight steps cut off.
  OpticsSpec still = spec_of(256);
  const double faint = 1e-3 * throughput_sr(still) / 15000.0;
  constexpr double kAmplitude_px = 2.0;
  Radiance in = patched_disc(40, 128);
  in.path.bends = true;
  for (int i = 0; i <= ImagePath::kSteps; ++i)
    in.path.off_px[static_cast<std::size_t>(i)] = {
        kAmplitude_px * std::sin(2.0 * kPi * i / ImagePath::kSteps), 0.0};
  const Projected swung = project(in, still, faint);
  OpticsSpec shaken = still;
  shaken.vibration.amplitude_rad = kAmplitude_px * still.camera.ifov_rad();
  in.path = {};
  const Projected blurred = project(in, shaken, faint);
  const Projected sharp = project(in, still, faint);
  double off = 0;
  double blur = 0;
  for (int v = 100; v < 156; ++v) {
    for (int u = 100; u < 156; ++u) {
      off = std::max(off, std::abs(swung.at(u, v) - blurred.at(u, v)));
      blur = std::max(blur, std::abs(sharp.at(u, v) - blurred.at(u, v)));
    }
  }
  EXPECT_LT(off, 0.02 * blur);
  EXPECT_GT(blur, 0.1 * sharp.highest());
}

TEST(OpticsSpread, ThePixelGridOfThePaperIsAnEighthOfAStarsPeakWrongAndNegative) {
  // The lens passes more than the pixel grid carries, and what is cut off rings. A star on a
  // pixel's centre, of the sum over all waves: 13 % of the peak, and less
  // than no light beside it.
  const OpticsSpec fine = spec_of(256);
  OpticsSpec paper = fine;
  paper.oversampling = 1;
  const double faint = 1e-3 * throughput_sr(fine) / 15000.0;
  Radiance in;
  in.region = {120, 120, 137, 137};
  in.oversampling = 1;
  in.grid.resize(17, 17);
  std::ranges::fill(in.grid.pixels(), 0.0F);
  in.grid.at(8, 8) = 1.0F;
  const Projected wrong = project(in, paper, faint);
  const ExactSpread spread(fine);
  const Eigen::MatrixXd right =
      throughput_sr(fine) * spread.image({128.0, 128.0}, 110, 110, 37, 37);
  double worst = 0;
  for (int v = 0; v < 37; ++v)
    for (int u = 0; u < 37; ++u)
      worst = std::max(worst, std::abs(right(v, u) - wrong.at(110 + u, 110 + v)));
  EXPECT_NEAR(worst / right.maxCoeff(), 0.13, 0.005);
  EXPECT_LT(wrong.lowest() / throughput_sr(fine), -0.003);
}

TEST(OpticsSpread, APlaceIsKeptWhateverTheCellsToAPixel) {
  // An even number has no cell in the middle of a pixel.
  for (const int cells : {1, 2, 3, 4, 6}) {
    OpticsSpec spec = spec_of(128);
    spec.oversampling = cells;
    Radiance in;
    in.region = {50, 60, 58, 66};
    in.oversampling = cells;
    in.grid.resize(8 * cells, 6 * cells);
    std::ranges::fill(in.grid.pixels(), 1.0F);
    const Projected out = project(in, spec, 1e-4 * throughput_sr(spec) / 15000.0);
    double u_sum = 0;
    double v_sum = 0;
    for (int v = 0; v < 128; ++v) {
      for (int u = 0; u < 128; ++u) {
        u_sum += out.at(u, v) * u;
        v_sum += out.at(u, v) * v;
      }
    }
    // Of wings that the frame cuts unevenly .05 px: 54 and 73 px on either side.
    EXPECT_NEAR(u_sum / out.sum(), 53.5, 0.06) << cells;
    EXPECT_NEAR(v_sum / out.sum(), 62.5, 0.06) << cells;
    EXPECT_NEAR(out.at(53, 62) / out.at(54, 63), 1.0, 1e-3) << cells;
    EXPECT_NEAR(out.at(50, 62) / out.at(57, 63), 1.0, 1e-3) << cells;
    EXPECT_NEAR(out.at(53, 59) / out.at(54, 66), 1.0, 2e-3) << cells;
  }
}

}  // namespace
}  // namespace engine
