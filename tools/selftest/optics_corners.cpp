// The spread of light: what a grid of pixels is too coarse for, and what is cut off.

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"
#include "engine/optics/optics.h"
#include "engine/optics/point_splat.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using engine::IrradianceImage;
using engine::kPi;
using engine::OtfCascade;
using engine::PixelPoint;

constexpr int kSide_px = 128;
constexpr double kFollowAll_w_m2 = 1e-30;  // of faint light

/// The paper's camera, its frame smaller.
engine::OpticsSpec paper_optics() {
  engine::OpticsSpec spec;
  spec.camera.width_px = spec.camera.height_px = kSide_px;
  return spec;
}

/// Points of 1 W/m^2 as PointSplat has them, in shares of their light.
class OurPoints {
 public:
  OurPoints() : pool_(1), splat_(spec_, OtfCascade(spec_), kFollowAll_w_m2, pool_) {}

  struct Picture {
    IrradianceImage image;
    double lost = 0;
  };
  [[nodiscard]] Picture picture(PixelPoint place, PixelPoint motion = {}) {
    Picture out;
    out.image.resize(kSide_px, kSide_px);
    const engine::PointSource point{place, 1.0 / splat_.pixels_per_irradiance(), motion};
    out.lost = splat_.add({&point, 1}, {}, out.image).lost_flux_share;
    return out;
  }

 private:
  engine::OpticsSpec spec_ = paper_optics();
  engine::WorkerPool pool_;
  engine::PointSplat splat_;
};

/// The even part of the OTF, pixel and all, on a grid of frequencies up to an end.
class Frequencies {
 public:
  Frequencies(const OtfCascade& cascade, double end_per_px, int steps)
      : step_(end_per_px / steps), steps_(steps) {
    const auto focus = cascade.focused(0.0);
    for (int i = 0; i < steps * steps; ++i)
      otf_.push_back(cascade.whole(at(i % steps), at(i / steps), focus).real());
  }
  /// Of a point's light, in the pixel so far from it.
  [[nodiscard]] double share(double du, double dv) const {
    double sum = 0;
    for (int j = 0; j < steps_; ++j) {
      double row = 0;
      for (int i = 0; i < steps_; ++i) row += otf_[index(i, j)] * std::cos(2.0 * kPi * at(i) * du);
      sum += row * std::cos(2.0 * kPi * at(j) * dv);
    }
    return 4.0 * step_ * step_ * sum;
  }

 private:
  [[nodiscard]] double at(int i) const { return (i + 0.5) * step_; }
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(steps_) +
           static_cast<std::size_t>(i);
  }
  double step_;
  int steps_;
  std::vector<double> otf_;
};

/// What a grid of pixels makes of a point: the product of OTFs up to the grid's Nyquist frequency.
struct GridError {
  Worst plain_off, our_off;    ///< of a pixel, in shares of the peak
  Worst plain_dark, our_dark;  ///< how far a pixel is below zero
};

GridError on_grid() {
  const OtfCascade cascade(paper_optics());
  const Frequencies all(cascade, cascade.cutoff_per_px(), 240);
  const Frequencies nyquist(cascade, 0.5, 104);
  OurPoints points;
  GridError out;
  const double peak = all.share(0.0, 0.0);
  for (const double phase : {0.03, 0.28, 0.47}) {
    const auto ours = points.picture({64.0 + phase, 64.0}).image;
    for (int v = -3; v <= 3; ++v) {
      for (int u = -3; u <= 3; ++u) {
        const double want = all.share(u - phase, v);
        const double plain = nyquist.share(u - phase, v);
        const auto got = static_cast<double>(ours.at(64 + u, 64 + v));
        out.plain_off.add(std::abs(plain - want) / peak);
        out.our_off.add(std::abs(got - want) / peak);
        out.plain_dark.add(std::max(0.0, -plain) / peak);
        out.our_dark.add(std::max(0.0, -got) / peak);
      }
    }
  }
  return out;
}

Corner cut_at_nyquist(const GridError& e) {
  return {
      "a lens that passes 178 lp/mm",
      "OTFs to Nyquist, 77 lp/mm",
      e.plain_off.value(),
      e.our_off.value(),
      2e-4,
      "of peak",
      "Error of a pixel of a point's image, at three places between pixels, against the integral "
      "of the same OTF to its cutoff. The bound is PointSplat's: its table's cubic, 1e-4, and "
      "as much for the integral. Li et al. 2023, eq 16 and 17."};
}

Corner dark_light(const GridError& e) {
  return {"light below zero",
          "OTFs to Nyquist, 77 lp/mm",
          e.plain_dark.value(),
          e.our_dark.value(),
          1e-4,
          "of peak",
          "Deepest pixel of the same images, below zero: there is no such light. The bound is the "
          "error of PointSplat's table."};
}

Corner vibration() {
  constexpr int kSteps = 2000;
  constexpr double kAmplitude_px = 2.0;
  const OtfCascade cascade(paper_optics());
  const auto focus = cascade.focused(0.0);
  const double step = cascade.cutoff_per_px() / kSteps;
  Worst plain;
  Worst ours;
  for (int x = 0; x <= 24; ++x) {
    double signed_sum = 0;
    double modulus_sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double f = (i + 0.5) * step;
      const double wave = cascade.whole(f, 0.0, focus).real() * std::cos(2.0 * kPi * f * 0.5 * x);
      const double shaken = engine::vibration_otf(f, kAmplitude_px);
      signed_sum += 2.0 * step * wave * shaken;
      modulus_sum += 2.0 * step * wave * std::abs(shaken);
    }
    plain.add(std::max(0.0, -modulus_sum));
    ours.add(std::max(0.0, -signed_sum));
  }
  return {"vibration of 2 px",
          "|J0|, an MTF",
          plain.value(),
          ours.value(),
          1e-5,
          "of it",
          "Deepest place of a line's image, below zero, in shares of its light in a pixel: without "
          "the sign of J0 its light is none. The bound is the OTF's table."};
}

/// How uneven the middle of a streak of 50 px is, along it.
double unevenness(const IrradianceImage& image) {
  double low = HUGE_VAL;
  double high = 0;
  for (int u = 50; u <= 78; ++u) {
    const auto light = static_cast<double>(image.at(u, 64));
    low = std::min(low, light);
    high = std::max(high, light);
  }
  return (high - low) / (high + low);
}

Corner smear() {
  constexpr int kCopies = 10;
  constexpr double kLength_px = 50;
  OurPoints points;
  IrradianceImage copies(kSide_px, kSide_px);
  std::ranges::fill(copies.pixels(), 0.0F);
  for (int i = 0; i < kCopies; ++i) {
    const double u = 64.0 + kLength_px * ((i + 0.5) / kCopies - 0.5);
    const auto one = points.picture({u, 64.0}).image;
    for (std::size_t k = 0; k < copies.pixels().size(); ++k)
      copies.pixels()[k] += one.pixels()[k] / kCopies;
  }
  const auto streak = points.picture({64.0, 64.0}, {kLength_px, 0.0}).image;
  return {
      "a smear of 50 px",
      "ten places of the exposure",
      unevenness(copies),
      unevenness(streak),
      1e-3,
      "of it",
      "How uneven the middle of an even streak is, (most - least) / (most + least): waves beyond "
      "the cutoff do not pass, so copies .865 px apart would do. The bound is what the wings "
      "miss beyond the ends, .0407 / (2 r^2) of the light at 11 px, 2e-4, five times."};
}

/// A disc .3 px wide on 3 x 3 cells to a pixel, each asked at its middle: how much light it has.
double disc_on_cells(double u, double v) {
  constexpr double kRadius_px = 0.3;
  double light = 0;
  for (int j = -6; j <= 6; ++j)
    for (int i = -6; i <= 6; ++i)
      if (std::hypot(i / 3.0 - u, j / 3.0 - v) < kRadius_px) light += 1.0 / 9.0;
  return light / (kPi * kRadius_px * kRadius_px);
}

double sum_of(const IrradianceImage& image) {
  double sum = 0;
  for (const float x : image.pixels()) sum += static_cast<double>(x);
  return sum;
}

Corner sub_pixel_light() {
  OurPoints points;
  const double centred = sum_of(points.picture({64.0, 64.0}).image);
  Worst plain;
  Worst ours;
  for (int i = 0; i <= 40; ++i) {
    const double u = i / 40.0;
    const double v = i / 17.0 - std::floor(i / 17.0);
    plain.add(std::abs(disc_on_cells(u, v) - 1.0));
    ours.add(std::abs(sum_of(points.picture({64.0 + u, 64.0 + v}).image) / centred - 1.0));
  }
  return {"a target of half a pixel",
          "cells asked at their middle",
          plain.value(),
          ours.value(),
          1e-3,
          "of it",
          "Change of a far target's light over 41 places between pixels. The bound is the error of "
          "PointSplat's table, 1e-4 of the peak, in the ten pixels that have most of the light."};
}

Corner wings() {
  OurPoints points;
  const auto got = points.picture({64.0, 64.0});
  double all = 0;
  double kernel = 0;
  for (int v = 0; v < kSide_px; ++v) {
    for (int u = 0; u < kSide_px; ++u) {
      const auto light = static_cast<double>(got.image.at(u, v));
      all += light;
      if (std::abs(u - 64) <= 7 && std::abs(v - 64) <= 7) kernel += light;
    }
  }
  // The law of the wings over all that lies outside a square of +-64 px.
  constexpr double kWing_px = 0.256 / (2.0 * kPi);  // light per px^2 at r: this / r^3
  const double beyond = kWing_px * 8.0 / std::sqrt(2.0) / 64.0;
  return {
      "the wings of a star",
      "a kernel of 15 x 15 px",
      std::abs(kernel - 1.0),
      std::abs(all + beyond - 1.0),
      0.2 * beyond + 1e-3,
      "of it",
      "Light that is nowhere: neither in the frame nor in what lies beyond it by the law of the "
      "wings, lambda N / (pi^3 p r^3). The bound is .2 of what is beyond, and 1e-3."};
}

}  // namespace

Room optics_corners() {
  const GridError grid = on_grid();
  return {
      "Optics",
      {cut_at_nyquist(grid), dark_light(grid), vibration(), smear(), sub_pixel_light(), wings()}};
}

}  // namespace corners
