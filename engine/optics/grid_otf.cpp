#include "engine/optics/grid_otf.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

// Whole waves of light are spread over this much of the field before anybody sees them.
constexpr double kUnseenSmear_px = 1e-3;
// Below so many turns sin(pi x)/(pi x) loses digits in single precision; its series has them.
constexpr float kFewTurns = 0.03F;

std::complex<float> wave_of(double turns) noexcept {
  return std::complex<float>(std::polar(1.0, -2.0 * kPi * turns));
}

}  // namespace

GridOtf::GridOtf(double cell_px, int averages, int longest)
    : cell_px_(cell_px),
      averages_(averages),
      rows_(static_cast<std::size_t>(longest)),
      row_waves_(static_cast<std::size_t>(longest)) {}

double GridOtf::pixel_factor(double per_px) const noexcept {
  double cell = 1;
  for (int i = 0; i < averages_; ++i) cell *= sinc(per_px * cell_px_);
  return sinc(per_px) / cell;
}

void GridOtf::prepare(const RadialOtf& radial, int height, const ImageMotion& motion) noexcept {
  radial_ = radial;
  directed_.reset();
  cutoff_per_px_ = radial.cutoff_per_px();
  prepare_rows(height, motion);
}

void GridOtf::prepare(const DirectedOtf& directed, int height, const ImageMotion& motion) noexcept {
  directed_.emplace(directed);
  cutoff_per_px_ = directed.cascade.cutoff_per_px();
  prepare_rows(height, motion);
}

void GridOtf::prepare_rows(int height, const ImageMotion& motion) noexcept {
  motion_ = motion;
  smears_ = motion.path.bends || std::hypot(motion.even_px.u, motion.even_px.v) > kUnseenSmear_px;
  for (int k = 0; k < height; ++k) {
    const int wave = k <= height / 2 ? k : k - height;
    const double per_px = static_cast<double>(wave) / (height * cell_px_);
    const double turns = per_px * motion.even_px.v;
    rows_[static_cast<std::size_t>(k)] = {
        static_cast<float>(per_px), static_cast<float>(pixel_factor(per_px)),
        static_cast<float>(turns), static_cast<float>(std::sin(kPi * turns)),
        static_cast<float>(std::cos(kPi * turns))};
    for (int i = 0; motion.path.bends && i < kKnots; ++i)
      row_waves_[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] =
          wave_of(per_px * motion.after(i).v);
  }
}

GridOtf::Complex GridOtf::directed(const Lanes& fu, float fv) const noexcept {
  Lanes re;
  Lanes im;
  for (int c = 0; c < Lanes::kCount; ++c) {
    const auto value = directed_->cascade.at(static_cast<double>(fu.v[c]), static_cast<double>(fv),
                                             directed_->lens);
    const float f = std::sqrt(fu.v[c] * fu.v[c] + fv * fv);
    const float less = directed_->less.table.empty() ? 0.0F : directed_->less.at(f);
    re.v[c] = static_cast<float>(value.real()) - less;
    im.v[c] = static_cast<float>(value.imag());
  }
  return {re, im};
}

/// The circle of the cutoff, and one more for rounding.
std::size_t GridOtf::passed(float per_px, std::size_t height) const noexcept {
  const auto f = static_cast<double>(per_px);
  const double most = std::sqrt(std::max(cutoff_per_px_ * cutoff_per_px_ - f * f, 0.0));
  const double waves = most * cell_px_ * static_cast<double>(height);
  return std::min(height / 2 + 1, static_cast<std::size_t>(waves) + 2);
}

/// A table is looked up number by number: a block of them first, then all their lanes at once.
void GridOtf::fill_radial(const Lanes& per_px, const Lanes& pixel,
                          std::span<Complex> out) const noexcept {
  constexpr std::size_t kBlock = 32;
  constexpr std::size_t kLanes = Lanes::kCount;
  std::array<float, kLanes> across2;
  for (std::size_t c = 0; c < kLanes; ++c) across2[c] = per_px.v[c] * per_px.v[c];
  const RadialOtf radial = radial_;
  std::array<float, kBlock * kLanes> otf;
  for (std::size_t first = 0; first < out.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, out.size() - first);
    for (std::size_t k = 0; k < count; ++k) {
      const float down = rows_[first + k].per_px;
      for (std::size_t c = 0; c < kLanes; ++c)
        otf[k * kLanes + c] = radial.at(std::sqrt(across2[c] + down * down));
    }
    for (std::size_t k = 0; k < count; ++k) {
      Lanes value;
      std::memcpy(&value.v, &otf[k * kLanes], sizeof value.v);
      out[first + k] = Complex(value * pixel * Lanes(rows_[first + k].pixel), Lanes{});
    }
  }
}

std::size_t GridOtf::fill_column(const Lanes& fx, std::span<Complex> out) const noexcept {
  Lanes per_px;
  Lanes pixel;
  for (int c = 0; c < Lanes::kCount; ++c) {
    const double f = static_cast<double>(fx.v[c]) / cell_px_;
    per_px.v[c] = static_cast<float>(f);
    pixel.v[c] = static_cast<float>(pixel_factor(f));
  }
  const std::size_t height = out.size();
  const std::size_t above = passed(per_px.v[0], height);
  const std::size_t below = std::max(above, height + 1 - above);
  if (!directed_) fill_radial(per_px, pixel, out.first(above));
  const auto fill = [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; directed_ && k < to; ++k)
      out[k] = directed(per_px, rows_[k].per_px) * (pixel * Lanes(rows_[k].pixel));
    if (motion_.path.bends) {
      follow_path(per_px, out, from, to);
    } else if (smears_) {
      smear(per_px, out, from, to);
    }
  };
  // A radial OTF is the same above and below, but for its motion.
  for (std::size_t k = below; !directed_ && k < height; ++k) out[k] = out[height - k];
  fill(0, above);
  fill(below, height);
  return above;
}

void GridOtf::smear(const Lanes& per_px, std::span<Complex> out, std::size_t from,
                    std::size_t to) const noexcept {
  Lanes turns;
  Lanes sine;
  Lanes cosine;
  for (int c = 0; c < Lanes::kCount; ++c) {
    const double t = static_cast<double>(per_px.v[c]) * motion_.even_px.u;
    turns.v[c] = static_cast<float>(t);
    sine.v[c] = static_cast<float>(std::sin(kPi * t));
    cosine.v[c] = static_cast<float>(std::cos(kPi * t));
  }
  for (std::size_t k = from; k < to; ++k) {
    const Row& row = rows_[k];
    const Lanes x = turns + Lanes(row.smear);
    const Lanes wave = sine * Lanes(row.cosine) + cosine * Lanes(row.sine);
    const Lanes p = Lanes(static_cast<float>(kPi)) * x;
    Lanes factor = Lanes(1.0F) - p * p * Lanes(1.0F / 6.0F);
    for (int c = 0; c < Lanes::kCount; ++c)
      if (std::abs(x.v[c]) >= kFewTurns) factor.v[c] = wave.v[c] / p.v[c];
    out[k] *= factor;
  }
}

/// The mean of a wave over a straight step is the difference of its ends over the phase between
/// them: what the waves are at the knots is all that is needed.
void GridOtf::follow_path(const Lanes& per_px, std::span<Complex> out, std::size_t from,
                          std::size_t to) const noexcept {
  constexpr auto kSteps = static_cast<std::size_t>(ImagePath::kSteps);
  std::array<Complex, kKnots> column;
  std::array<PixelPoint, kSteps> steps;
  for (std::size_t i = 0; i < column.size(); ++i) {
    Lanes re;
    Lanes im;
    for (int c = 0; c < Lanes::kCount; ++c) {
      const auto wave =
          wave_of(static_cast<double>(per_px.v[c]) * motion_.after(static_cast<int>(i)).u);
      re.v[c] = wave.real();
      im.v[c] = wave.imag();
    }
    column[i] = Complex(re, im);
    if (i < kSteps) steps[i] = motion_.step_px(static_cast<int>(i));
  }
  for (std::size_t k = from; k < to; ++k) {
    const Row& row = rows_[k];
    const Waves& waves = row_waves_[k];
    const auto at_knot = [&](std::size_t i) {
      const Lanes a(waves[i].real());
      const Lanes b(waves[i].imag());
      return Complex(column[i].real() * a - column[i].imag() * b,
                     column[i].real() * b + column[i].imag() * a);
    };
    Lanes re;
    Lanes im;
    Complex before = at_knot(0);
    for (std::size_t i = 0; i < kSteps; ++i) {
      const Complex after = at_knot(i + 1);
      const Lanes p =
          Lanes(kPi) * (per_px * Lanes(steps[i].u) + Lanes(row.per_px) * Lanes(steps[i].v));
      // Of few turns: the mean of the ends times sinc over cosine.
      Lanes mean_re =
          (before.real() + after.real()) * Lanes(0.5F) * (Lanes(1.0F) + p * p * Lanes(1.0F / 3.0F));
      Lanes mean_im =
          (before.imag() + after.imag()) * Lanes(0.5F) * (Lanes(1.0F) + p * p * Lanes(1.0F / 3.0F));
      const Lanes rise_re = after.real() - before.real();
      const Lanes rise_im = after.imag() - before.imag();
      for (int c = 0; c < Lanes::kCount; ++c) {
        if (std::abs(p.v[c]) < static_cast<float>(kPi) * kFewTurns) continue;
        mean_re.v[c] = -0.5F * rise_im.v[c] / p.v[c];
        mean_im.v[c] = 0.5F * rise_re.v[c] / p.v[c];
      }
      re += mean_re;
      im += mean_im;
      before = after;
    }
    const Lanes share(1.0F / ImagePath::kSteps);
    const Lanes a = out[k].real();
    const Lanes b = out[k].imag();
    out[k] = Complex(share * (a * re - b * im), share * (a * im + b * re));
  }
}

}  // namespace engine
