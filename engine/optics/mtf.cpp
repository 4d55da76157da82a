#include "engine/optics/mtf.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

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

}  // namespace engine
