#include "engine/orbit/signal_limit.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

/// Of a Lambert ball of albedo 1: what it sends to where `a` is, over irradiance and radius^2.
double ball(double a) noexcept {
  return 2.0 / (3.0 * kPi) * (std::sin(a) + (kPi - a) * std::cos(a));
}
// Its slope is 2 / (3 pi) (pi - a) sin a, largest at tan a = pi - a.
constexpr double kSteepestBall = 0.3863;

}  // namespace

double SignalLimit::signal_e(double range_m, double phase_angle_rad) const noexcept {
  const double angle_rad = radius_m / range_m;
  const double all_e =
      electrons_per_w_m2 * sun_w_m2 * albedo * ball(phase_angle_rad) * angle_rad * angle_rad;
  const double radius_px = angle_rad / ifov_rad;
  return all_e / (1.0 / peak_share + kPi * radius_px * radius_px);
}

double SignalLimit::snr(double range_m, double phase_angle_rad) const noexcept {
  const double e = signal_e(range_m, phase_angle_rad);
  return e / std::sqrt(e + dark_noise_e * dark_noise_e);
}

double SignalLimit::margin_m(double range_m, double phase_angle_rad) const noexcept {
  // The signal that has the least SNR, from signal^2 = snr^2 (signal + noise^2).
  const double k2 = least_snr * least_snr;
  const double least_e = 0.5 * (k2 + std::sqrt(k2 * k2 + 4.0 * k2 * dark_noise_e * dark_noise_e));
  // signal_e(range) = least_e solved for the range's square.
  const double per_ball =
      peak_share * electrons_per_w_m2 * sun_w_m2 * albedo * radius_m * radius_m / least_e;
  const double radius_px_m = radius_m / ifov_rad;
  const double furthest2 =
      per_ball * ball(phase_angle_rad) - peak_share * kPi * radius_px_m * radius_px_m;
  const double left2 = furthest2 - range_m * range_m;
  // A way x changes range^2 by 2 range x + x^2 at most, and the phase angle by pi/2 x / range.
  const double first = 2.0 * range_m + per_ball * kSteepestBall * 0.5 * kPi / range_m;
  const double way =
      2.0 * std::abs(left2) / (first + std::sqrt(first * first + 4.0 * std::abs(left2)));
  return std::copysign(std::min(way, range_m), left2);
}

}  // namespace engine
