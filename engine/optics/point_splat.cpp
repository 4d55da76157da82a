#include "engine/optics/point_splat.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kBandRows = 64;  // that one thread takes at a time
constexpr double kUnseenStreak_px = 1e-3;

double airy_constant(const OpticsSpec& spec) {
  const double wavelength_m = 0.5 * (spec.band.band_low_m + spec.band.band_high_m);
  return wavelength_m * spec.camera.focal_length_m /
         (spec.band.aperture_m * spec.camera.pixel_pitch_m * std::pow(kPi, 3) *
          (1.0 - spec.band.obscuration));
}

/// Shares of a point's light by displacement, on `places` points `step_px` apart along each axis,
/// the first at no displacement: the cosine transform of the OTF over one quarter of the plane.
Eigen::MatrixXd image_of_a_point(const BandOtf& diffraction, double pitch_m,
                                 const PointSplat::Kind& kind, int places, double step_px) {
  // Images repeat after so many pixels; half of that away from a neighbour 3e-8 of the light is
  // left.
  constexpr int kPeriod_px = 256;
  const int waves = static_cast<int>(diffraction.cutoff_per_m() * pitch_m * kPeriod_px) + 1;
  const auto square = [&](double f) { return sinc(f) / sinc(f * kind.mean_over_px); };
  Eigen::MatrixXd cosines(places, waves);
  Eigen::MatrixXd otf(waves, waves);
  for (int k = 0; k < waves; ++k) {
    const double f = static_cast<double>(k) / kPeriod_px;  // cycles per pixel
    const double share = (k == 0 ? 1.0 : 2.0) / kPeriod_px;
    for (int i = 0; i < places; ++i) cosines(i, k) = share * std::cos(2.0 * kPi * f * i * step_px);
    for (int j = 0; j < waves; ++j) {
      const double g = static_cast<double>(j) / kPeriod_px;
      const double per_px = std::hypot(f, g);
      const double apart = kind.wings != nullptr ? kind.wings->otf(per_px) : 0.0;
      otf(k, j) = (diffraction.at(per_px / pitch_m) - apart) * square(f) * square(g);
    }
  }
  return cosines * otf * cosines.transpose();
}

/// Lagrange's cubic through four places -1, 0, 1, 2 at t in [0, 1).
std::array<float, 4> cubic(double t) noexcept {
  const double a = t + 1.0;
  const double b = t - 1.0;
  const double c = t - 2.0;
  return {static_cast<float>(-t * b * c / 6.0), static_cast<float>(a * b * c / 2.0),
          static_cast<float>(-a * t * c / 2.0), static_cast<float>(a * t * b / 6.0)};
}

constexpr std::array<double, 3> kNodes{-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr std::array<double, 3> kWeights{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

}  // namespace

/// Rows of the detector that one thread writes to.
struct PointSplat::Band {
  int top;
  int bottom;
};

/// One image of a point.
struct PointSplat::Footprint {
  double u;
  double v;
  double light;  ///< irradiance on the detector, summed over pixels
  int reach_px;
};

PointSplat::PointSplat(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool,
                       const Kind& kind)
    : width_px_(spec.camera.width_px),
      height_px_(spec.camera.height_px),
      core_px_(std::min(kCore_px, spec.largest_wing_px)),
      stride_((2 * core_px_ + 1 + 7) / 8 * 8),
      gain_(throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2)),
      airy_(airy_constant(spec)),
      faint_w_m2_(faint_w_m2),
      largest_reach_px_(kind.wings != nullptr ? core_px_ : spec.largest_wing_px),
      pool_(pool),
      footprints_(static_cast<std::size_t>((height_px_ + kBandRows - 1) / kBandRows)) {
  fill_tables(spec, kind);
}

void PointSplat::fill_tables(const OpticsSpec& spec, const Kind& kind) {
  const int side = 2 * core_px_ + 1;
  const int places = (core_px_ + 1) * kPhases + 2;
  const Eigen::MatrixXd image =
      image_of_a_point(BandOtf(spec.band), spec.camera.pixel_pitch_m, kind, places, 1.0 / kPhases);
  peak_share_ = image(0, 0);
  const int shares = kTables * kTables * side * stride_;
  tables_.resize(static_cast<std::size_t>(shares));
  std::size_t at = 0;
  // Phase 1 + kPhases / 2 is no displacement. A point to the right of a pixel's centre shows to the
  // pixel as a displacement to the left.
  const auto place = [&](int pixel, int phase) {
    return std::abs((pixel - core_px_) * kPhases - (phase - 1 - kPhases / 2));
  };
  for (int phase_v = 0; phase_v < kTables; ++phase_v)
    for (int phase_u = 0; phase_u < kTables; ++phase_u)
      for (int row = 0; row < side; ++row)
        for (int column = 0; column < stride_; ++column, ++at)
          tables_[at] = column < side
                            ? static_cast<float>(image(place(row, phase_v), place(column, phase_u)))
                            : 0.0F;
}

const float* PointSplat::table_row(int phase_v, int phase_u, int row) const noexcept {
  const int side = 2 * core_px_ + 1;
  return tables_.data() +
         static_cast<std::ptrdiff_t>((phase_v * kTables + phase_u) * side + row) * stride_;
}

double PointSplat::reach_px(double irradiance_w_m2) const noexcept {
  return std::clamp(std::cbrt(reach_px3_per_w_m2() * irradiance_w_m2), 1.0 * kLeastReach_px,
                    largest_reach_px_);
}

PointSplat::Report PointSplat::add(std::span<const PointSource> points, IrradianceImage& out,
                                   double least_reach_px) noexcept {
  ENSURE(out.width() == width_px_ && out.height() == height_px_);
  Report report;
  if (points.empty()) return report;
  const auto reach = [&](const PointSource& point) {
    return std::max(reach_px(point.irradiance_w_m2), std::min(least_reach_px, largest_reach_px_));
  };
  const int bands = static_cast<int>(footprints_.size());
  pool_.rows(0, bands, [&](int b) {
    const Band band{b * kBandRows, std::min((b + 1) * kBandRows, height_px_)};
    std::uint64_t& count = footprints_[static_cast<std::size_t>(b)];
    count = 0;
    for (const PointSource& point : points) streak(point, reach(point), band, out, count);
  });
  for (const std::uint64_t count : footprints_) report.footprints += count;
  double light = 0;
  double lost = 0;
  for (const PointSource& point : points) {
    light += point.irradiance_w_m2;
    // The mean Airy pattern's law, added up over all that lies further away.
    lost += point.irradiance_w_m2 * 2.0 * kPi * airy_ / reach(point);
  }
  report.lost_flux_share = light > 0.0 ? lost / light : 0.0;
  return report;
}

void PointSplat::streak(const PointSource& point, double followed_px, const Band& band,
                        IrradianceImage& out, std::uint64_t& footprints) const noexcept {
  const double reach = std::ceil(followed_px);
  const double light = point.irradiance_w_m2 * gain_;
  const PixelPoint& m = point.motion_px;
  // The part of the line, from -.5 to .5, whose images can reach the band.
  double from = -0.5;
  double to = 0.5;
  const auto clip = [&](double place, double motion, double low, double high) {
    if (std::abs(motion) < kUnseenStreak_px) {
      if (place < low || place > high) to = from - 1.0;
      return;
    }
    const double a = (low - place) / motion;
    const double b = (high - place) / motion;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  };
  clip(point.place.u, m.u, -1.0 - reach, width_px_ + reach);
  clip(point.place.v, m.v, band.top - 1.0 - reach, band.bottom + reach);
  if (!(from <= to)) return;
  const int reach_px = static_cast<int>(reach);
  const double length_px = std::hypot(m.u, m.v);
  if (length_px < kUnseenStreak_px) {
    stamp({point.place.u, point.place.v, light, reach_px}, band, out);
    ++footprints;
    return;
  }
  const double panels = std::ceil(length_px);
  const double last = std::min(std::floor((to + 0.5) * panels), panels - 1.0);
  for (double p = std::max(std::floor((from + 0.5) * panels), 0.0); p <= last; p += 1.0) {
    for (std::size_t i = 0; i < kNodes.size(); ++i) {
      const double t = (p + 0.5 + 0.5 * kNodes[i]) / panels - 0.5;
      stamp({point.place.u + t * m.u, point.place.v + t * m.v, light * kWeights[i] / panels,
             reach_px},
            band, out);
      ++footprints;
    }
  }
}

void PointSplat::stamp(const Footprint& print, const Band& band,
                       IrradianceImage& out) const noexcept {
  add_core(print, band, out);
  if (print.reach_px > core_px_) add_wings(print, band, out);
}

void PointSplat::add_core(const Footprint& print, const Band& band,
                          IrradianceImage& out) const noexcept {
  const int reach = std::min(print.reach_px, core_px_);
  const int u = static_cast<int>(std::floor(print.u + 0.5));
  const int v = static_cast<int>(std::floor(print.v + 0.5));
  const int left = std::max(u - reach, 0);
  const int right = std::min(u + reach + 1, width_px_);
  const int top = std::max(v - reach, band.top);
  const int bottom = std::min(v + reach + 1, band.bottom);
  if (left >= right || top >= bottom) return;
  const double place_u = (print.u - u) * kPhases;
  const double place_v = (print.v - v) * kPhases;
  const int phase_u = static_cast<int>(std::floor(place_u)) + kPhases / 2;
  const int phase_v = static_cast<int>(std::floor(place_v)) + kPhases / 2;
  const auto weight_u = cubic(place_u - std::floor(place_u));
  const auto weight_v = cubic(place_v - std::floor(place_v));
  const auto light = static_cast<float>(print.light);
  for (int row = top; row < bottom; ++row) {
    float* pixels = out.row(row).data() + left;
    for (int j = 0; j < 4; ++j) {
      const float w = light * weight_v[static_cast<std::size_t>(j)];
      const int first = left - u + core_px_;
      const float* a = table_row(phase_v + j, phase_u, row - v + core_px_) + first;
      const float* b = table_row(phase_v + j, phase_u + 1, row - v + core_px_) + first;
      const float* c = table_row(phase_v + j, phase_u + 2, row - v + core_px_) + first;
      const float* d = table_row(phase_v + j, phase_u + 3, row - v + core_px_) + first;
      for (int i = 0; i < right - left; ++i)
        pixels[i] +=
            w * (weight_u[0] * a[i] + weight_u[1] * b[i] + weight_u[2] * c[i] + weight_u[3] * d[i]);
    }
  }
}

/// Beyond the core's square, to a circle.
void PointSplat::add_wings(const Footprint& print, const Band& band,
                           IrradianceImage& out) const noexcept {
  const int u = static_cast<int>(std::floor(print.u + 0.5));
  const int v = static_cast<int>(std::floor(print.v + 0.5));
  const int reach = print.reach_px;
  const double strength = print.light * airy_;
  const double furthest = 1.0 * reach * reach;
  const auto add = [&](std::span<float> pixels, int from, int to, double dv) {
    for (int i = std::max(from, 0); i < std::min(to, width_px_); ++i) {
      const double du = i - print.u;
      const double square = du * du + dv * dv;
      if (square <= furthest)
        pixels[static_cast<std::size_t>(i)] +=
            static_cast<float>(strength / (square * std::sqrt(square)));
    }
  };
  for (int row = std::max(v - reach, band.top); row < std::min(v + reach + 1, band.bottom); ++row) {
    const double dv = row - print.v;
    const bool beside = std::abs(row - v) <= core_px_;
    const int inner_left = beside ? u - core_px_ : u + reach + 1;
    add(out.row(row), u - reach, inner_left, dv);
    if (beside) add(out.row(row), u + core_px_ + 1, u + reach + 1, dv);
  }
}

}  // namespace engine
