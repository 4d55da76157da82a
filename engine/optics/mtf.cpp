#include "engine/optics/mtf.h"

#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kTableSteps = 4096;

/// The overlap of two unit circles whose centres are 2 nu apart, over pi.
double full_pupil(double nu) noexcept {
  if (nu >= 1.0) return 0.0;
  return 2.0 / kPi * (std::acos(nu) - nu * std::sqrt(1.0 - nu * nu));
}

/// The overlap of a unit circle and one of radius e, centres 2 nu apart, over pi.
double mixed_overlap(double nu, double e) noexcept {
  const double d = 2.0 * nu;
  if (d <= 1.0 - e) return e * e;
  if (d >= 1.0 + e) return 0.0;
  const double at_unit = std::acos((d * d + 1.0 - e * e) / (2.0 * d));
  const double at_small = std::acos((d * d + e * e - 1.0) / (2.0 * d * e));
  const double kite =
      0.5 * std::sqrt((-d + 1.0 + e) * (d + 1.0 - e) * (d - 1.0 + e) * (d + 1.0 + e));
  return (at_unit + e * e * at_small - kite) / kPi;
}

}  // namespace

double diffraction_otf(double nu, double obscuration) noexcept {
  nu = std::abs(nu);
  if (nu >= 1.0) return 0.0;
  if (obscuration <= 0.0) return full_pupil(nu);
  const double e = obscuration;
  const double hole = e * e * full_pupil(nu / e);
  return (full_pupil(nu) + hole - 2.0 * mixed_overlap(nu, e)) / (1.0 - e * e);
}

double sinc(double x) noexcept {
  const double p = kPi * x;
  // Two terms of the series leave 3e-13 here.
  if (std::abs(p) < 0.02) return 1.0 - p * p / 6.0 * (1.0 - p * p / 20.0);
  return std::sin(p) / p;
}

double vibration_otf(double frequency, double amplitude) noexcept {
  return std::cyl_bessel_j(0.0, std::abs(2.0 * kPi * amplitude * frequency));
}

double jitter_otf(double frequency, double rms) noexcept {
  const double x = 2.0 * kPi * rms * frequency;
  return std::exp(-0.5 * x * x);
}

BandOtf::BandOtf(const Spec& spec)
    : cutoff_per_m_(spec.aperture_m / (spec.focal_length_m * spec.band_low_m)),
      table_(kTableSteps + 2, 0.0F) {
  constexpr std::array<double, 5> kNodes{-0.9061798459386640, -0.5384693101056831, 0.0,
                                         0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 5> kWeights{0.2369268850561891, 0.4786286704993665,
                                           0.5688888888888889, 0.4786286704993665,
                                           0.2369268850561891};
  const double middle_m = 0.5 * (spec.band_high_m + spec.band_low_m);
  const double half_m = 0.5 * (spec.band_high_m - spec.band_low_m);
  for (int i = 0; i <= kTableSteps; ++i) {
    const double frequency = cutoff_per_m_ * i / kTableSteps;
    double sum = 0;
    for (std::size_t k = 0; k < kNodes.size(); ++k) {
      const double wavelength_m = middle_m + half_m * kNodes[k];
      const double nu = frequency * wavelength_m * spec.focal_length_m / spec.aperture_m;
      sum += 0.5 * kWeights[k] * diffraction_otf(nu, spec.obscuration);
    }
    table_[static_cast<std::size_t>(i)] = static_cast<float>(sum);
  }
}

double BandOtf::at(double frequency_per_m) const noexcept {
  const double place = frequency_per_m / cutoff_per_m_ * kTableSteps;
  if (!(place < kTableSteps)) return 0.0;
  const auto low = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(low);
  return (1.0 - part) * table_[low] + part * table_[low + 1];
}

}  // namespace engine
