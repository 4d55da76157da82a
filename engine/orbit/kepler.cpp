#include "engine/orbit/kepler.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace engine {
namespace {

/// E - sin E (sign -1) or sinh H - H (sign 1) for an argument >= 0, without the cancellation near
/// zero.
double odd_rest(double x, double sign) noexcept {
  if (x > 0.5) return sign < 0.0 ? x - std::sin(x) : std::sinh(x) - x;
  // x^3/3! -+ x^5/5! + ...: at 0.5 the ninth term is below 1e-17 of the first.
  const double x2 = x * x;
  double term = x * x2 / 6.0;
  double sum = term;
  for (int n = 4; n <= 18; n += 2) {
    term *= sign * x2 / (static_cast<double>(n) * (n + 1.0));
    sum += term;
  }
  return sum;
}

/// What Kepler's equation leaves over at a place, and how fast that grows.
struct Left {
  double f = 0;
  double slope = 0;
  double sine = 0;  ///< of the place; hyperbolic for a hyperbola
};

/// Halley's steps from `x`, inside a bracket of the root.
template <class Equation>
EccentricAnomaly halley(double e, double x, double low, double high,
                        const Equation& equation) noexcept {
  x = std::clamp(x, low, high);
  int i = 0;
  bool settled = low >= high;
  for (; i < kMostKeplerIterations && low < high && !settled; ++i) {
    const Left left = equation(x);
    (left.f > 0.0 ? high : low) = x;
    const double newton = left.f / left.slope;
    const double step = newton / (1.0 - 0.5 * newton * e * left.sine / left.slope);
    const double next = x - step;
    const bool inside = next >= low && next <= high;
    const double before = x;
    x = inside ? next : 0.5 * (low + high);
    // Halley's error is cubic: a step below 1e-6 leaves less than the rounding.
    settled = (inside && std::abs(step) <= 1e-6 * x) || x == before || low >= high;
  }
  return {x, std::max(i, 1), settled};
}

/// The root of e x^3 / 6 + |1 - e| x = M: the start in the near-parabolic corner.
double root_of_cubic(double e, double from_parabola, double m) noexcept {
  const double p = 2.0 * from_parabola / e;
  const double q = 3.0 * m / e;
  const double root = std::cbrt(q + std::sqrt(q * q + p * p * p));
  return root > 0.0 ? root - p / root : 0.0;
}

EccentricAnomaly solve_upper_half(double e, double m) noexcept {
  // A hair above, so that rounding does not leave the root outside.
  const double high = std::min({m + e, m / (1.0 - e) * (1.0 + 1e-15), kPi});
  double x = m + e * std::sin(m) / (1.0 - std::sin(m + e) + std::sin(m));
  if (m < 0.3 && e > 0.8) x = root_of_cubic(e, 1.0 - e, m);
  return halley(e, x, m, high, [&](double at) {
    const double half_sine = std::sin(0.5 * at);
    return Left{(1.0 - e) * at + e * odd_rest(at, -1.0) - m,
                (1.0 - e) + 2.0 * e * half_sine * half_sine,  // 1 - e cos E
                std::sin(at)};
  });
}

EccentricAnomaly solve_upper_branch(double e, double m) noexcept {
  if (!(m > 0.0) || std::isinf(m)) return {m, 1, m == 0.0};
  const double low = std::asinh(m / e) * (1.0 - 4e-16);
  const double high = std::min(std::asinh(m / (e - 1.0)), std::cbrt(6.0 * m / e)) * (1.0 + 1e-15);
  double x = std::asinh((m + low) / e);
  if (m < 1.0) x = root_of_cubic(e, e - 1.0, m);
  return halley(e, x, low, high, [&](double at) {
    const double half_sine = std::sinh(0.5 * at);
    return Left{(e - 1.0) * at + e * odd_rest(at, 1.0) - m,
                (e - 1.0) + 2.0 * e * half_sine * half_sine,  // e cosh H - 1
                std::sinh(at)};
  });
}

}  // namespace

EccentricAnomaly solve_kepler(double eccentricity, double mean_anomaly_rad) noexcept {
  const double m = std::remainder(mean_anomaly_rad, 2.0 * kPi);
  EccentricAnomaly e_anomaly = solve_upper_half(eccentricity, std::abs(m));
  e_anomaly.rad = std::copysign(e_anomaly.rad, m);
  return e_anomaly;
}

EccentricAnomaly solve_hyperbolic_kepler(double eccentricity, double mean_anomaly_rad) noexcept {
  EccentricAnomaly h = solve_upper_branch(eccentricity, std::abs(mean_anomaly_rad));
  h.rad = std::copysign(h.rad, mean_anomaly_rad);
  return h;
}

double mean_anomaly_rad(double e, double eccentric_anomaly_rad) noexcept {
  const double x = std::abs(eccentric_anomaly_rad);
  const double m =
      e < 1.0 ? (1.0 - e) * x + e * odd_rest(x, -1.0) : (e - 1.0) * x + e * odd_rest(x, 1.0);
  return std::copysign(m, eccentric_anomaly_rad);
}

KeplerPropagator::KeplerPropagator(const KeplerElements& elements, Epoch epoch,
                                   double mu_m3_s2) noexcept
    : elements_(elements),
      epoch_(epoch),
      mean_motion_rad_s_(std::sqrt(mu_m3_s2 / std::pow(std::abs(elements.semi_major_axis_m), 3))) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  const Eigen::Matrix3d turn = (AngleAxisd(elements.raan_rad, Vector3d::UnitZ()) *
                                AngleAxisd(elements.inclination_rad, Vector3d::UnitX()) *
                                AngleAxisd(elements.argument_of_perigee_rad, Vector3d::UnitZ()))
                                   .toRotationMatrix();
  toward_perigee_ = turn.col(0);
  quarter_turn_ahead_ = turn.col(1);
}

OrbitState KeplerPropagator::at(Epoch t) const noexcept {
  const double m = elements_.mean_anomaly_rad + mean_motion_rad_s_ * seconds(t - epoch_);
  return elements_.eccentricity < 1.0 ? on_ellipse(m) : on_hyperbola(m);
}

OrbitState KeplerPropagator::on_ellipse(double m) const noexcept {
  const double a_m = elements_.semi_major_axis_m;
  const double e = elements_.eccentricity;
  const double e_anomaly = solve_kepler(e, m).rad;

  // In the orbit plane: p towards the perigee, q a quarter turn ahead.
  const double minor = std::sqrt((1.0 - e) * (1.0 + e));
  const double cos_e = std::cos(e_anomaly);
  const double sin_e = std::sin(e_anomaly);
  const double rate = a_m * mean_motion_rad_s_ / (1.0 - e * cos_e);
  OrbitState state;
  state.position.m = a_m * ((cos_e - e) * toward_perigee_ + minor * sin_e * quarter_turn_ahead_);
  state.velocity.m_s = rate * (-sin_e * toward_perigee_ + minor * cos_e * quarter_turn_ahead_);
  return state;
}

OrbitState KeplerPropagator::on_hyperbola(double m) const noexcept {
  const double a_m = -elements_.semi_major_axis_m;
  const double e = elements_.eccentricity;
  const double h = solve_hyperbolic_kepler(e, m).rad;

  const double minor = std::sqrt((e - 1.0) * (e + 1.0));
  const double cosh_h = std::cosh(h);
  const double sinh_h = std::sinh(h);
  const double half_sine = std::sinh(0.5 * h);
  const double from_focus = (e - 1.0) - 2.0 * half_sine * half_sine;  // e - cosh H
  const double rate = a_m * mean_motion_rad_s_ / (e * cosh_h - 1.0);
  OrbitState state;
  state.position.m = a_m * (from_focus * toward_perigee_ + minor * sinh_h * quarter_turn_ahead_);
  state.velocity.m_s = rate * (-sinh_h * toward_perigee_ + minor * cosh_h * quarter_turn_ahead_);
  return state;
}

double KeplerPropagator::speed_bound_m_s() const noexcept {
  const double e = elements_.eccentricity;
  const double faster = std::sqrt((1.0 + e) / std::abs(1.0 - e));
  // A hair above: the bound holds after rounding, too.
  return std::abs(elements_.semi_major_axis_m) * mean_motion_rad_s_ * faster * (1.0 + 1e-9);
}

}  // namespace engine
