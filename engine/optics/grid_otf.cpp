#include "engine/optics/grid_otf.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

// Whole waves of light are spread over this much of the field before anybody sees them.
constexpr double kUnseenSmear_px = 1e-3;
// Below so many turns sin(pi x)/(pi x) loses digits in single precision; its series has them.
constexpr float kFewTurns = 0.03F;

}  // namespace

GridOtf::GridOtf(double cell_px, int averages, int longest)
    : cell_px_(cell_px), averages_(averages), rows_(static_cast<std::size_t>(longest)) {}

double GridOtf::pixel_factor(double per_px) const noexcept {
  double cell = 1;
  for (int i = 0; i < averages_; ++i) cell *= sinc(per_px * cell_px_);
  return sinc(per_px) / cell;
}

void GridOtf::prepare(const RadialOtf& radial, int height, PixelPoint smear_px) noexcept {
  radial_ = radial;
  directed_.reset();
  cutoff_per_px_ = radial.cutoff_per_px();
  prepare_rows(height, smear_px);
}

void GridOtf::prepare(const DirectedOtf& directed, int height, PixelPoint smear_px) noexcept {
  directed_.emplace(directed);
  cutoff_per_px_ = directed.cascade.cutoff_per_px();
  prepare_rows(height, smear_px);
}

void GridOtf::prepare_rows(int height, PixelPoint smear_px) noexcept {
  smear_px_ = smear_px;
  smears_ = std::hypot(smear_px.u, smear_px.v) > kUnseenSmear_px;
  for (int k = 0; k < height; ++k) {
    const int wave = k <= height / 2 ? k : k - height;
    const double per_px = static_cast<double>(wave) / (height * cell_px_);
    const double turns = per_px * smear_px.v;
    rows_[static_cast<std::size_t>(k)] = {
        static_cast<float>(per_px), static_cast<float>(pixel_factor(per_px)),
        static_cast<float>(turns), static_cast<float>(std::sin(kPi * turns)),
        static_cast<float>(std::cos(kPi * turns))};
  }
}

GridOtf::Complex GridOtf::unmoved(const Lanes& fu, float fv) const noexcept {
  Lanes re;
  Lanes im;
  for (int c = 0; c < Lanes::kCount; ++c) {
    const float f = std::sqrt(fu.v[c] * fu.v[c] + fv * fv);
    if (!directed_) {
      re.v[c] = radial_.at(f);
      continue;
    }
    const auto value = directed_->cascade.at(static_cast<double>(fu.v[c]), static_cast<double>(fv),
                                             directed_->lens);
    const float less = directed_->less.table.empty() ? 0.0F : directed_->less.at(f);
    re.v[c] = static_cast<float>(value.real()) - less;
    im.v[c] = static_cast<float>(value.imag());
  }
  return {re, im};
}

void GridOtf::fill_column(const Lanes& fx, std::span<Complex> out) const noexcept {
  constexpr int kLanes = Lanes::kCount;
  Lanes per_px;
  Lanes pixel;
  Lanes turns;
  Lanes sine;
  Lanes cosine;
  for (int c = 0; c < kLanes; ++c) {
    const double f = static_cast<double>(fx.v[c]) / cell_px_;
    const double t = f * smear_px_.u;
    per_px.v[c] = static_cast<float>(f);
    pixel.v[c] = static_cast<float>(pixel_factor(f));
    turns.v[c] = static_cast<float>(t);
    sine.v[c] = static_cast<float>(std::sin(kPi * t));
    cosine.v[c] = static_cast<float>(std::cos(kPi * t));
  }
  const std::size_t height = out.size();
  for (std::size_t k = 0; k < height; ++k) {
    const Row& row = rows_[k];
    // A radial OTF is the same above and below.
    const std::size_t mirrored = height - k;
    out[k] = directed_ || mirrored >= k ? unmoved(per_px, row.per_px) : out[mirrored];
  }
  for (std::size_t k = 0; k < height; ++k) {
    const Row& row = rows_[k];
    Lanes factor = pixel * Lanes(row.pixel);
    if (smears_) {
      const Lanes x = turns + Lanes(row.smear);
      const Lanes wave = sine * Lanes(row.cosine) + cosine * Lanes(row.sine);
      const Lanes p = Lanes(static_cast<float>(kPi)) * x;
      const Lanes series = Lanes(1.0F) - p * p * Lanes(1.0F / 6.0F);
      for (int c = 0; c < kLanes; ++c)
        factor.v[c] *= std::abs(x.v[c]) < kFewTurns ? series.v[c] : wave.v[c] / p.v[c];
    }
    out[k] *= factor;
  }
}

}  // namespace engine
