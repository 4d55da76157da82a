#include "engine/optics/point_splat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"
#include "engine/core/lagrange.h"
#include "engine/optics/mtf.h"
#include "engine/optics/point_image.h"

namespace engine {
namespace {

constexpr int kBandRows = 64;  // that one thread takes at a time
constexpr double kUnseenStreak_px = 1e-3;

double airy_constant(const OpticsSpec& spec) {
  const double wavelength_m = 0.5 * (spec.lens.band_low_m + spec.lens.band_high_m);
  return wavelength_m * spec.camera.focal_length_m /
         (spec.lens.aperture_m * spec.camera.pixel_pitch_m * std::pow(kPi, 3) *
          (1.0 - spec.lens.obscuration));
}

// Between levels, in waves: of W20^2 where its sign does not matter.
constexpr double kStepOfSquares = 0.04;
constexpr double kStep = 1.0 / 12.0;
// Nobody sees stars beside what is nearer than this.
constexpr double kNearest_m = 1e3;

/// The defocus that points may have, of either sign.
struct DefocusRange {
  double low_m = 0;
  double high_m = 0;
};
DefocusRange defocus_range(const OpticsSpec& spec, const OtfCascade& cascade) noexcept {
  const auto seen = [&](double range_m, double target_m) {
    return cascade.seen_defocus_m(spec.defocus_m(range_m, target_m));
  };
  const double far = std::numeric_limits<double>::infinity();
  DefocusRange range;
  // Beyond what the lens is focused at are the stars, or a target that is not what it is focused
  // at.
  if (spec.stars || spec.focus == Focus::kDistance)
    range.low_m = std::min(0.0, seen(far, kNearest_m));
  if (spec.focus != Focus::kTarget) range.high_m = std::max(0.0, seen(kNearest_m, far));
  const double most_m = PointSplat::kMostDefocus_waves * middle_wavelength_m(spec);
  return {std::max(range.low_m, -most_m), std::min(range.high_m, most_m)};
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

PointSplat::PointSplat(const OpticsSpec& spec, const OtfCascade& cascade, double faint_w_m2,
                       WorkerPool& pool, const Kind& kind)
    : width_px_(spec.camera.width_px),
      height_px_(spec.camera.height_px),
      core_px_(
          std::min(spec.lens.spider_vanes > 0 ? kCoreOfSpider_px : kCore_px, spec.largest_wing_px)),
      stride_((2 * core_px_ + 1 + 7) / 8 * 8),
      gain_(throughput_sr(spec) / std::pow(spec.camera.ifov_rad(), 2)),
      airy_(airy_constant(spec)),
      faint_w_m2_(faint_w_m2),
      largest_reach_px_(kind.wings != nullptr ? core_px_ : spec.largest_wing_px),
      wave_m_(middle_wavelength_m(spec)),
      pool_(pool),
      even_(cascade.lens().even()),
      footprints_(static_cast<std::size_t>((height_px_ + kBandRows - 1) / kBandRows)) {
  const DefocusRange range = kind.wings == nullptr ? defocus_range(spec, cascade) : DefocusRange{};
  const double low = measure(range.low_m);
  const double high = measure(range.high_m);
  const double step = even_ ? kStepOfSquares : kStep;
  // Zero is a level: what is in focus is not blended.
  const int below = static_cast<int>(std::ceil(-low / step));
  const int above = static_cast<int>(std::ceil(high / step));
  for (int i = -below; i <= above; ++i) {
    const double part = i < 0 ? -low * i / below : i > 0 ? high * i / above : 0.0;
    const double waves = even_ ? std::copysign(std::sqrt(std::abs(part)), part) : part;
    add_level(cascade, kind, waves * wave_m_);
  }
  focus(0.0);
}

double PointSplat::measure(double defocus_m) const noexcept {
  const double waves = defocus_m / wave_m_;
  return even_ ? waves * std::abs(waves) : waves;
}

void PointSplat::focus(double defocus_m) noexcept {
  const double place =
      std::clamp(measure(defocus_m), levels_.front().measure, levels_.back().measure);
  lower_ = 0;
  while (lower_ + 2 < levels_.size() && levels_[lower_ + 1].measure <= place) ++lower_;
  upper_share_ = 0.0;
  if (levels_.size() > 1)
    upper_share_ =
        (place - levels_[lower_].measure) / (levels_[lower_ + 1].measure - levels_[lower_].measure);
}

void PointSplat::add_level(const OtfCascade& cascade, const Kind& kind, double defocus_m) {
  const int side = 2 * core_px_ + 1;
  const auto focused = cascade.focused(defocus_m);
  const auto square = [&](double f) { return sinc(f) / sinc(f * kind.mean_over_px); };
  const auto apart = [&](double fu, double fv) {
    return kind.wings != nullptr ? kind.wings->otf(std::hypot(fu, fv)) : 0.0;
  };
  const PointImageSpec lattice{cascade.cutoff_per_px(), (core_px_ + 1) * kPhases + 1,
                               1.0 / kPhases};
  const Eigen::MatrixXd image =
      cascade.radial()
          ? even_point_image(lattice,
                             [&](double fu, double fv) {
                               const double otf = cascade.at_radial(std::hypot(fu, fv), focused);
                               return (otf - apart(fu, fv)) * square(fu) * square(fv);
                             })
          : point_image(lattice, [&](double fu, double fv) {
              return (cascade.at(fu, fv, focused) - apart(fu, fv)) * square(fu) * square(fv);
            });
  if (defocus_m == 0.0) peak_share_ = image(lattice.half_places, lattice.half_places);
  Level& level = levels_.emplace_back();
  level.measure = measure(defocus_m);
  level.shares.resize(static_cast<std::size_t>(kTables * kTables * side * stride_));
  std::size_t at = 0;
  // Phase 1 + kPhases / 2 is no displacement. A point to the right of a pixel's centre shows to the
  // pixel as a displacement to the left.
  const auto place = [&](int pixel, int phase) {
    return lattice.half_places + (pixel - core_px_) * kPhases - (phase - 1 - kPhases / 2);
  };
  for (int phase_v = 0; phase_v < kTables; ++phase_v)
    for (int phase_u = 0; phase_u < kTables; ++phase_u)
      for (int row = 0; row < side; ++row)
        for (int column = 0; column < stride_; ++column, ++at)
          level.shares[at] =
              column < side ? static_cast<float>(image(place(row, phase_v), place(column, phase_u)))
                            : 0.0F;
}

const float* PointSplat::table_row(const Level& level, int phase_v, int phase_u,
                                   int row) const noexcept {
  const int side = 2 * core_px_ + 1;
  return level.shares.data() +
         static_cast<std::ptrdiff_t>((phase_v * kTables + phase_u) * side + row) * stride_;
}

double PointSplat::reach_px(double irradiance_w_m2) const noexcept {
  return std::clamp(std::cbrt(reach_px3_per_w_m2() * irradiance_w_m2), 1.0 * kLeastReach_px,
                    largest_reach_px_);
}

PointSplat::Report PointSplat::add(std::span<const PointSource> points, const ImagePath& path,
                                   IrradianceImage& out, double least_reach_px) noexcept {
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
    for (const PointSource& point : points) {
      if (path.bends) {
        follow(point, path, reach(point), band, out, count);
      } else {
        streak(point, reach(point), band, out, count);
      }
    }
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

void PointSplat::follow(const PointSource& point, const ImagePath& path, double followed_px,
                        const Band& band, IrradianceImage& out,
                        std::uint64_t& footprints) const noexcept {
  const ImageMotion motion{point.motion_px, path};
  for (int i = 0; i < ImagePath::kSteps; ++i) {
    const PixelPoint middle = motion.middle_of(i);
    streak({{point.place.u + middle.u, point.place.v + middle.v},
            point.irradiance_w_m2 / ImagePath::kSteps,
            motion.step_px(i)},
           followed_px, band, out, footprints);
  }
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
  if (upper_share_ < 1.0) add_core(print, levels_[lower_], 1.0 - upper_share_, band, out);
  if (upper_share_ > 0.0) add_core(print, levels_[lower_ + 1], upper_share_, band, out);
  if (print.reach_px > core_px_) add_wings(print, band, out);
}

void PointSplat::add_core(const Footprint& print, const Level& level, double weight,
                          const Band& band, IrradianceImage& out) const noexcept {
  // Where light is followed less far than the table goes, the outermost pixels fade, so that no
  // centroid jumps as pixels come in and drop out.
  const bool fades = print.reach_px < core_px_;
  const int reach = fades ? print.reach_px + 1 : core_px_;
  const auto share = [&](double away) {
    return fades ? std::clamp(print.reach_px + 0.5 - std::abs(away), 0.0, 1.0) : 1.0;
  };
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
  const auto weight_u = lagrange_cubic(place_u - std::floor(place_u));
  const auto weight_v = lagrange_cubic(place_v - std::floor(place_v));
  for (int row = top; row < bottom; ++row) {
    const auto light = static_cast<float>(weight * print.light * share(row - print.v));
    float* pixels = out.row(row).data() + left;
    for (int j = 0; j < 4; ++j) {
      const float w = light * weight_v[static_cast<std::size_t>(j)];
      const int first = left - u + core_px_;
      const float* a = table_row(level, phase_v + j, phase_u, row - v + core_px_) + first;
      const float* b = table_row(level, phase_v + j, phase_u + 1, row - v + core_px_) + first;
      const float* c = table_row(level, phase_v + j, phase_u + 2, row - v + core_px_) + first;
      const float* d = table_row(level, phase_v + j, phase_u + 3, row - v + core_px_) + first;
      const auto add = [&](int from, int to, float part) {
        for (int i = from; i < to; ++i)
          pixels[i] += part * (weight_u[0] * a[i] + weight_u[1] * b[i] + weight_u[2] * c[i] +
                               weight_u[3] * d[i]);
      };
      // Two columns at either end may fade.
      const int begin = std::clamp(u - reach + 2 - left, 0, right - left);
      const int end = std::clamp(u + reach - 1 - left, begin, right - left);
      for (int i = 0; i < begin; ++i)
        add(i, i + 1, w * static_cast<float>(share(left + i - print.u)));
      add(begin, end, w);
      for (int i = end; i < right - left; ++i)
        add(i, i + 1, w * static_cast<float>(share(left + i - print.u)));
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
  const auto add = [&](std::span<float> pixels, int from, int to, double dv) {
    for (int i = std::max(from, 0); i < std::min(to, width_px_); ++i) {
      const double du = i - print.u;
      const double square = du * du + dv * dv;
      const double away = std::sqrt(square);
      // The last pixel fades, so that no centroid jumps as pixels come in and drop out.
      const double share = std::clamp(reach + 0.5 - away, 0.0, 1.0);
      pixels[static_cast<std::size_t>(i)] += static_cast<float>(share * strength / (square * away));
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
