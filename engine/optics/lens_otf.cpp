#include "engine/optics/lens_otf.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/core/lagrange.h"
#include "engine/optics/mtf.h"
#include "engine/optics/pupil_grid.h"

namespace engine {
namespace {

constexpr int kClearSteps = 4096;  // of the first factor, and with a spider:
constexpr int kSpiderSteps = 750;  // bends of 2.5 per unit lie within 2.5 / (4 * 750)
constexpr int kLineSteps = 1024;   // of the second, for a radial pupil
constexpr int kPlaneSteps = 192;   // for others
constexpr float kNothing = 1e-9F;
constexpr double kLineLevels = 8.0;  // to a wave of W20
constexpr double kPlaneLevels = 6.0;
constexpr double kSteepestRadial_waves = 32.0;
constexpr double kSteepestPlane_waves = 8.0;

// A table's margin: a line's cubic takes one step before zero and two beyond the end, a plane's
// quintic two and three.
constexpr int kLineSize = kLineSteps + 4;
constexpr int kPlaneSide = kPlaneSteps + 3;
constexpr int kPlaneWidth = 2 * kPlaneSide + 1;
constexpr int kPlaneRows = kPlaneSteps + 6;
constexpr int kSpiderWidth = 2 * kSpiderSteps + 2;

std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }
constexpr std::size_t kLineCells = kLineSize;
constexpr std::size_t kPlaneCells =
    static_cast<std::size_t>(kPlaneWidth) * static_cast<std::size_t>(kPlaneRows);

std::size_t plane_cell(int x, int y) noexcept {
  return index(y + 2) * index(kPlaneWidth) + index(x + kPlaneSide);
}

/// Of a table of the half plane fy >= 0 without a margin; places in steps.
double on_grid(const float* plane, double x, double y) noexcept {
  if (!(x * x + y * y < 1.0 * kSpiderSteps * kSpiderSteps)) return 0.0;
  if (y < 0.0) {
    x = -x;
    y = -y;
  }
  const double left = std::floor(x);
  const double low = std::floor(y);
  const auto s = static_cast<float>(x - left);
  const auto t = static_cast<float>(y - low);
  const float* p = plane + index(static_cast<int>(low)) * index(kSpiderWidth) +
                   index(static_cast<int>(left) + kSpiderSteps);
  const float* q = p + kSpiderWidth;
  return static_cast<double>((1.0F - t) * ((1.0F - s) * p[0] + s * p[1]) +
                             t * ((1.0F - s) * q[0] + s * q[1]));
}

/// Lagrange's quintic through six places -2 to 3 at t in [0, 1).
std::array<double, 6> quintic(double t) noexcept {
  const double a = t + 2.0;
  const double b = t + 1.0;
  const double c = t - 1.0;
  const double d = t - 2.0;
  const double e = t - 3.0;
  return {-b * t * c * d * e / 120.0, a * t * c * d * e / 24.0,  -a * b * c * d * e / 12.0,
          a * b * t * d * e / 12.0,   -a * b * t * c * e / 24.0, a * b * t * c * d / 120.0};
}

/// Nodes across the overlap of a radial pupil with itself, over one half of it: the other has the
/// same real part. `even` and `odd` are the weights of cosine and sine of the defocus' phase.
struct Overlap {
  std::vector<double> x;
  std::vector<double> even;
  std::vector<double> odd;
};

Overlap radial_overlap(const LensSpec& lens, const Pupil& pupil, const GaussRule& along,
                       const GaussRule& across, double nu, double wavelength_m) {
  Overlap all;
  const double shift = 2.0 * nu;
  const double e = lens.obscuration;
  const double per_m = 2.0 * kPi / wavelength_m;
  const std::vector<double> corners = overlap_corners(shift, e);
  for (std::size_t panel = 0; panel + 1 < corners.size(); ++panel) {
    const double middle = 0.5 * (corners[panel] + corners[panel + 1]);
    const double half = 0.5 * (corners[panel + 1] - corners[panel]);
    for (std::size_t i = 0; i < along.nodes.size(); ++i) {
      // A sine's map takes the roots at the panel's ends away.
      const double t = 0.5 * kPi * along.nodes[i];
      const double x = middle + half * std::sin(t);
      const double a = x - 0.5 * shift;
      const double b = x + 0.5 * shift;
      const double high = std::sqrt(std::max(1.0 - b * b, 0.0));
      const double low = std::sqrt(std::max(e * e - a * a, 0.0));
      if (low >= high) continue;
      // Both halves in x and both in y, over the open area.
      const double weight =
          half * 0.5 * kPi * std::cos(t) * along.weights[i] * 4.0 / (kPi * (1.0 - e * e));
      std::complex<double> sum = high - low;
      if (!pupil.flat()) {
        sum = 0;
        for (std::size_t k = 0; k < across.nodes.size(); ++k) {
          const double y = 0.5 * (high + low) + 0.5 * (high - low) * across.nodes[k];
          sum += 0.5 * (high - low) * across.weights[k] *
                 std::polar(1.0, per_m * (pupil.wavefront_m(a, y) - pupil.wavefront_m(b, y)));
        }
      }
      all.x.push_back(x);
      all.even.push_back(weight * sum.real());
      all.odd.push_back(weight * sum.imag());
    }
  }
  return all;
}

/// Adds the overlap's real part at each level of defocus; levels are evenly spaced, so one factor
/// turns each node's phase to the next. `per_m` is the phase per metre of W20 and unit of x.
void add_levels(const Overlap& nodes, double per_m, double first_m, double step_m, double share,
                std::size_t levels, double* out) {
  const std::size_t n = nodes.x.size();
  std::vector<double> c(n);
  std::vector<double> s(n);
  std::vector<double> step_c(n);
  std::vector<double> step_s(n);
  for (std::size_t i = 0; i < n; ++i) {
    c[i] = std::cos(per_m * nodes.x[i] * first_m);
    s[i] = std::sin(per_m * nodes.x[i] * first_m);
    step_c[i] = std::cos(per_m * nodes.x[i] * step_m);
    step_s[i] = std::sin(per_m * nodes.x[i] * step_m);
  }
  for (std::size_t level = 0; level < levels; ++level) {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += nodes.even[i] * c[i] + nodes.odd[i] * s[i];
      const double next = c[i] * step_c[i] - s[i] * step_s[i];
      s[i] = s[i] * step_c[i] + c[i] * step_s[i];
      c[i] = next;
    }
    out[level * kLineCells] += share * sum;
  }
}

}  // namespace

LensOtf::LensOtf(const LensSpec& lens, double largest_defocus_m)
    : cutoff_per_m_(1.0 / lens.nu_m(lens.band_low_m)),
      reach_per_m_(1.0 / lens.nu_m(band_lines(lens).front().wavelength_m)),
      radial_(true),
      curvature_m_(0),
      spider_(lens.spider_vanes > 0) {
  const Pupil pupil(lens);
  radial_ = pupil.radial();
  curvature_m_ = pupil.curvature_m();
  choose_levels(lens, pupil, largest_defocus_m);
  if (spider_) {
    fill_spider(lens, pupil);
  } else {
    fill_clear(lens);
  }
  if (levels_ == 0) return;
  if (radial_) {
    fill_line(lens, pupil);
  } else {
    fill_plane(lens, pupil);
  }
}

void LensOtf::choose_levels(const LensSpec& lens, const Pupil& pupil, double asked_m) {
  ENSURE(asked_m >= 0.0);
  const double steepest_m =
      (radial_ ? kSteepestRadial_waves : kSteepestPlane_waves) * lens.band_low_m;
  largest_defocus_m_ = std::min(asked_m, std::max(0.5 * (steepest_m - pupil.steepest_m()), 0.0));
  if (largest_defocus_m_ == 0.0) {
    first_m_ = curvature_m_;
    levels_ = pupil.flat() && curvature_m_ == 0.0 ? 0 : 1;
    return;
  }
  step_m_ = band_lines(lens).front().wavelength_m / (radial_ ? kLineLevels : kPlaneLevels);
  even_ = pupil.flat() && pupil.centred();
  const double low = (curvature_m_ - largest_defocus_m_) / step_m_;
  const double high = (curvature_m_ + largest_defocus_m_) / step_m_;
  const double first = even_ ? 0.0 : std::floor(low) - 2.0;
  const double last = std::floor(even_ ? std::max(high, -low) : high) + 3.0;
  first_m_ = first * step_m_;
  levels_ = static_cast<std::size_t>(last - first) + 1;
}

/// The first factor without a spider, by |f|.
void LensOtf::fill_clear(const LensSpec& lens) {
  clear_line_.assign(index(kClearSteps + 2), 0.0F);
  for (int i = 0; i <= kClearSteps; ++i) {
    double sum = 0;
    for (const BandLine& line : band_lines(lens)) {
      const double nu = reach_per_m_ * i / kClearSteps * lens.nu_m(line.wavelength_m);
      sum += line.share * shannon_factor(lens.wavefront_rms_m / line.wavelength_m, nu) *
             diffraction_otf(nu, lens.obscuration);
    }
    clear_line_[index(i)] = static_cast<float>(sum);
  }
}

/// With a spider: every wavelength's OTF is the same overlap, stretched.
void LensOtf::fill_spider(const LensSpec& lens, const Pupil& pupil) {
  PupilGrid grid(pupil, 2.0 / kSpiderSteps, kSpiderSteps);
  grid.flat_overlap();
  std::vector<float> overlap(index(kSpiderWidth) * index(kSpiderSteps + 2), 0.0F);
  const auto cell = [](int x, int y) {
    return index(y) * index(kSpiderWidth) + index(x + kSpiderSteps);
  };
  for (int y = 0; y <= kSpiderSteps; ++y)
    for (int x = -kSpiderSteps; x <= kSpiderSteps; ++x)
      if (x * x + y * y < kSpiderSteps * kSpiderSteps)
        overlap[cell(x, y)] = static_cast<float>(grid.at(x, y).real() / grid.open_area());
  // Cells that an edge cuts lie under themselves by their area's square alone.
  overlap[cell(0, 0)] = 1.0F;

  clear_plane_.assign(overlap.size(), 0.0F);
  for (const BandLine& line : band_lines(lens)) {
    const double stretch = reach_per_m_ * lens.nu_m(line.wavelength_m);
    for (int y = 0; y <= kSpiderSteps; ++y) {
      for (int x = -kSpiderSteps; x <= kSpiderSteps; ++x) {
        const double u = stretch * x;
        const double v = stretch * y;
        const double nu = std::hypot(u, v) / kSpiderSteps;
        if (nu >= 1.0) continue;
        clear_plane_[cell(x, y)] += static_cast<float>(
            line.share * shannon_factor(lens.wavefront_rms_m / line.wavelength_m, nu) *
            on_grid(overlap.data(), u, v));
      }
    }
  }
}

/// The second factor of a radial pupil, at all levels of defocus.
void LensOtf::fill_line(const LensSpec& lens, const Pupil& pupil) {
  const double waves = std::max(std::abs(first_m_), std::abs(defocus_of(levels_ - 1))) /
                       band_lines(lens).front().wavelength_m;
  const GaussRule along(24 + static_cast<int>(5.0 * waves));
  const GaussRule across(24);
  std::vector<double> sums(levels_ * kLineCells, 0.0);
  std::vector<double> wholes(kLineCells, 0.0);
  for (const BandLine& line : band_lines(lens)) {
    for (int i = 0; i <= kLineSteps; ++i) {
      const double nu = reach_per_m_ * i / kLineSteps * lens.nu_m(line.wavelength_m);
      if (nu >= 1.0) break;
      const double share =
          line.share * shannon_factor(lens.wavefront_rms_m / line.wavelength_m, nu);
      wholes[index(i + 1)] += share * diffraction_otf(nu, lens.obscuration);
      const Overlap nodes = radial_overlap(lens, pupil, along, across, nu, line.wavelength_m);
      add_levels(nodes, 8.0 * kPi * nu / line.wavelength_m, first_m_, step_m_, share, levels_,
                 &sums[index(i + 1)]);
    }
  }
  lines_.assign(sums.size(), 0.0F);
  for (std::size_t level = 0; level < levels_; ++level) {
    float* out = &lines_[level * kLineCells];
    for (std::size_t i = 1; i < kLineCells; ++i)
      if (wholes[i] > 0.0) out[i] = static_cast<float>(sums[level * kLineCells + i] / wholes[i]);
    out[0] = out[2];
  }
}

/// The second factor of any other pupil. The cells of each wavelength's grid are such that one
/// shift is one step of the table, whatever the wavelength.
void LensOtf::fill_plane(const LensSpec& lens, const Pupil& pupil) {
  planes_.assign(levels_ * kPlaneCells, Complex{});
  std::vector<float> wholes(kPlaneCells, 0.0F);
  for (const BandLine& line : band_lines(lens)) {
    const double step_nu = reach_per_m_ * lens.nu_m(line.wavelength_m) / kPlaneSteps;
    const int lags = static_cast<int>(1.0 / step_nu);
    PupilGrid grid(pupil, 2.0 * step_nu, lags);
    const auto add = [&](const auto& out) {
      for (int y = 0; y <= lags; ++y) {
        for (int x = -lags; x <= lags; ++x) {
          const double nu = step_nu * std::hypot(x, y);
          if (nu >= 1.0) continue;
          const double share = line.share / grid.open_area() *
                               shannon_factor(lens.wavefront_rms_m / line.wavelength_m, nu);
          out(plane_cell(x, y), Complex(share * grid.at(x, y)));
        }
      }
    };
    grid.flat_overlap();
    add([&](std::size_t i, Complex part) { wholes[i] += part.real(); });
    for (std::size_t level = 0; level < levels_; ++level) {
      grid.overlap(line.wavelength_m, defocus_of(level));
      add([&](std::size_t i, Complex part) { planes_[level * kPlaneCells + i] += part; });
    }
  }
  for (std::size_t level = 0; level < levels_; ++level) {
    Complex* out = &planes_[level * kPlaneCells];
    for (std::size_t i = 0; i < kPlaneCells; ++i)
      out[i] = wholes[i] > kNothing ? out[i] / wholes[i] : Complex{};
    for (const int y : {1, 2})
      for (int x = -kPlaneSide; x <= kPlaneSide; ++x)
        out[plane_cell(x, -y)] = std::conj(out[plane_cell(-x, y)]);
  }
}

LensOtf::Blend LensOtf::blend(double defocus_m) const noexcept {
  Blend all;
  if (levels_ <= 1) return all;
  const double within = std::clamp(defocus_m, -largest_defocus_m_, largest_defocus_m_);
  const double wanted_m = curvature_m_ + within;
  if (within != defocus_m)
    all.stretch = std::max(std::abs((curvature_m_ + defocus_m) / wanted_m), 1.0);
  const double place = ((even_ ? std::abs(wanted_m) : wanted_m) - first_m_) / step_m_;
  const double low = std::floor(place);
  all.count = kStencil;
  all.weight = quintic(place - low);
  // Levels below the first are those of the other sign.
  for (std::size_t k = 0; k < kStencil; ++k)
    all.level[k] = static_cast<std::size_t>(std::abs(low + static_cast<double>(k) - 2.0));
  return all;
}

double LensOtf::clear(double f_per_m) const noexcept {
  const double place = f_per_m / reach_per_m_ * kClearSteps;
  if (!(place < kClearSteps)) return 0.0;
  const auto low = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(low);
  return (1.0 - part) * static_cast<double>(clear_line_[low]) +
         part * static_cast<double>(clear_line_[low + 1]);
}

double LensOtf::clear(double fx_per_m, double fy_per_m) const noexcept {
  if (!spider_) return clear(std::hypot(fx_per_m, fy_per_m));
  const double steps = kSpiderSteps / reach_per_m_;
  return on_grid(clear_plane_.data(), fx_per_m * steps, fy_per_m * steps);
}

double LensOtf::bent(const float* line, double f_per_m) const noexcept {
  const double place = f_per_m / reach_per_m_ * kLineSteps;
  if (!(place < kLineSteps)) return 0.0;
  const int low = static_cast<int>(place);
  const auto w = lagrange_cubic(place - low);
  const float* p = line + low;
  return static_cast<double>(w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + w[3] * p[3]);
}

std::complex<double> LensOtf::bent(const Complex* plane, double fx_per_m,
                                   double fy_per_m) const noexcept {
  double x = fx_per_m / reach_per_m_ * kPlaneSteps;
  double y = fy_per_m / reach_per_m_ * kPlaneSteps;
  if (!(x * x + y * y < 1.0 * kPlaneSteps * kPlaneSteps)) return 0.0;
  const bool below = y < 0.0;
  if (below) {
    x = -x;
    y = -y;
  }
  const double left = std::floor(x);
  const double low = std::floor(y);
  const auto wx = quintic(x - left);
  const auto wy = quintic(y - low);
  std::array<float, kStencil> w{};
  for (std::size_t i = 0; i < kStencil; ++i) w[i] = static_cast<float>(wx[i]);
  const Complex* p = plane + plane_cell(static_cast<int>(left) - 2, static_cast<int>(low) - 2);
  Complex sum = 0;
  for (std::size_t j = 0; j < kStencil; ++j, p += kPlaneWidth) {
    Complex row = 0;
    for (std::size_t i = 0; i < kStencil; ++i) row += w[i] * p[i];
    sum += static_cast<float>(wy[j]) * row;
  }
  return std::complex<double>(below ? std::conj(sum) : sum);
}

double LensOtf::at_radial(double f_per_m, double defocus_m) const noexcept {
  ENSURE(radial_);
  const Blend tables = blend(defocus_m);
  const double f = std::abs(f_per_m) * tables.stretch;
  if (levels_ == 0) return clear(f);
  double sum = 0;
  for (std::size_t k = 0; k < tables.count; ++k)
    sum += tables.weight[k] * bent(&lines_[tables.level[k] * kLineCells], f);
  return clear(f) * sum;
}

std::complex<double> LensOtf::at(double fx_per_m, double fy_per_m,
                                 double defocus_m) const noexcept {
  if (radial_) return at_radial(std::hypot(fx_per_m, fy_per_m), defocus_m);
  const Blend tables = blend(defocus_m);
  const double fx = fx_per_m * tables.stretch;
  const double fy = fy_per_m * tables.stretch;
  if (levels_ == 0) return clear(fx, fy);
  std::complex<double> sum = 0;
  for (std::size_t k = 0; k < tables.count; ++k)
    sum += tables.weight[k] * bent(&planes_[tables.level[k] * kPlaneCells], fx, fy);
  return clear(fx, fy) * sum;
}

LensOtf::Slice LensOtf::slice(double defocus_m) const {
  Slice out;
  out.lens_ = this;
  if (levels_ > 0 && radial_) out.line_.resize(kLineCells);
  if (levels_ > 0 && !radial_) out.plane_.resize(kPlaneCells);
  focus(defocus_m, out);
  return out;
}

void LensOtf::focus(double defocus_m, Slice& out) const noexcept {
  ENSURE(out.lens_ == this);
  const Blend tables = blend(defocus_m);
  out.stretch_ = tables.stretch;
  const auto mix = [&](const auto& from, auto& to) {
    std::fill(to.begin(), to.end(), 0.0F);
    for (std::size_t k = 0; k < tables.count; ++k) {
      const auto weight = static_cast<float>(tables.weight[k]);
      const auto* level = from.data() + tables.level[k] * to.size();
      for (std::size_t i = 0; i < to.size(); ++i) to[i] += weight * level[i];
    }
  };
  mix(lines_, out.line_);
  mix(planes_, out.plane_);
}

double LensOtf::Slice::at_radial(double f_per_m) const noexcept {
  ENSURE(lens_->radial_);
  const double f = std::abs(f_per_m) * stretch_;
  return line_.empty() ? lens_->clear(f) : lens_->clear(f) * lens_->bent(line_.data(), f);
}

std::complex<double> LensOtf::Slice::at(double fx_per_m, double fy_per_m) const noexcept {
  if (lens_->radial_) return at_radial(std::hypot(fx_per_m, fy_per_m));
  const double fx = fx_per_m * stretch_;
  const double fy = fy_per_m * stretch_;
  if (plane_.empty()) return lens_->clear(fx, fy);
  return lens_->clear(fx, fy) * lens_->bent(plane_.data(), fx, fy);
}

double LensOtf::unseen_defocus_m(double share) const {
  constexpr int kSteps = 48;  // of frequency, over the half plane
  const Slice sharp = slice(0.0);
  Slice other = slice(0.0);
  const auto unseen = [&](double w_m) {
    focus(w_m, other);
    for (int i = 0; i <= kSteps; ++i) {
      for (int k = radial_ ? 0 : -kSteps; k <= (radial_ ? 0 : kSteps); ++k) {
        const double fx = reach_per_m_ * k / kSteps;
        const double fy = reach_per_m_ * i / kSteps;
        if (std::abs(other.at(fx, fy) - sharp.at(fx, fy)) > share) return false;
      }
    }
    return true;
  };
  const auto both = [&](double w_m) { return unseen(w_m) && unseen(-w_m); };
  // The first change over the limit, from small defocus on; then halving.
  double low = 0;
  double high = largest_defocus_m_ / 1024.0;
  while (high < largest_defocus_m_ && both(high)) {
    low = high;
    high = std::min(1.25 * high, largest_defocus_m_);
  }
  if (both(high)) return high;
  for (int i = 0; i < 20; ++i) (both(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

}  // namespace engine
