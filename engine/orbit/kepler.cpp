#include "engine/orbit/kepler.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

/// E - sin E for 0 <= E <= pi, without the cancellation near zero.
double e_minus_sin(double e_anomaly) noexcept {
  if (e_anomaly > 0.5) return e_anomaly - std::sin(e_anomaly);
  // E^3/3! - E^5/5! + ...: at 0.5 the ninth term is below 1e-17 of the first.
  const double x2 = e_anomaly * e_anomaly;
  double term = e_anomaly * x2 / 6.0;
  double sum = term;
  for (int n = 4; n <= 18; n += 2) {
    term *= -x2 / (static_cast<double>(n) * (n + 1.0));
    sum += term;
  }
  return sum;
}

EccentricAnomaly solve_upper_half(double e, double m) noexcept {
  double low = m;
  // A hair above, so that rounding does not leave the root outside.
  double high = std::min({m + e, m / (1.0 - e) * (1.0 + 1e-15), kPi});
  // Near-parabolic corner: the cubic e E^3/6 + (1 - e) E = M is the better start.
  double x = m + e * std::sin(m) / (1.0 - std::sin(m + e) + std::sin(m));
  if (m < 0.3 && e > 0.8) {
    const double p = 2.0 * (1.0 - e) / e;
    const double q = 3.0 * m / e;
    const double root = std::cbrt(q + std::sqrt(q * q + p * p * p));
    x = root > 0.0 ? root - p / root : 0.0;
  }
  x = std::clamp(x, low, high);
  int i = 0;
  for (; i < kMostKeplerIterations && low < high; ++i) {
    const double f = (1.0 - e) * x + e * e_minus_sin(x) - m;
    (f > 0.0 ? high : low) = x;
    const double half_sine = std::sin(0.5 * x);
    const double slope = (1.0 - e) + 2.0 * e * half_sine * half_sine;  // 1 - e cos E
    const double newton = f / slope;
    const double step = newton / (1.0 - 0.5 * newton * e * std::sin(x) / slope);
    const double next = x - step;
    const bool inside = next >= low && next <= high;
    const double before = x;
    x = inside ? next : 0.5 * (low + high);
    // Halley's error is cubic: a step below 1e-6 leaves less than the rounding.
    if ((inside && std::abs(step) <= 1e-6 * x) || x == before) break;
  }
  return {x, std::min(i + 1, kMostKeplerIterations)};
}

}  // namespace

KeplerElements read_elements(const ConfigTable& table) {
  KeplerElements elements;
  elements.semi_major_axis_m = table.number("semi_major_axis_km", positive()) * 1e3;
  elements.eccentricity = table.number("eccentricity", from_below(0.0, 1.0));
  elements.inclination_rad = table.number("inclination_deg", between(0.0, 180.0)) * kDegree;
  const Range turn = between(-360.0, 360.0);
  elements.argument_of_perigee_rad = table.number("argument_of_perigee_deg", turn) * kDegree;
  elements.raan_rad = table.number("raan_deg", turn) * kDegree;
  elements.mean_anomaly_rad = table.number("mean_anomaly_deg", turn) * kDegree;
  const double perigee_m = elements.semi_major_axis_m * (1.0 - elements.eccentricity);
  if (perigee_m < kEarthRadius_m) {
    table.fail("semi_major_axis_km", "and eccentricity put the perigee inside the Earth, " +
                                         std::to_string(perigee_m / 1e3) + " km from its centre");
  }
  return elements;
}

EccentricAnomaly solve_kepler(double eccentricity, double mean_anomaly_rad) noexcept {
  const double m = std::remainder(mean_anomaly_rad, 2.0 * kPi);
  EccentricAnomaly e_anomaly = solve_upper_half(eccentricity, std::abs(m));
  e_anomaly.rad = std::copysign(e_anomaly.rad, m);
  return e_anomaly;
}

KeplerPropagator::KeplerPropagator(const KeplerElements& elements, Epoch epoch,
                                   double mu_m3_s2) noexcept
    : elements_(elements),
      epoch_(epoch),
      mean_motion_rad_s_(std::sqrt(mu_m3_s2 / std::pow(elements.semi_major_axis_m, 3))) {
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
  const double a_m = elements_.semi_major_axis_m;
  const double e = elements_.eccentricity;
  const double n = mean_motion_rad_s_;
  const double m = elements_.mean_anomaly_rad + n * seconds(t - epoch_);
  const double e_anomaly = solve_kepler(e, m).rad;

  // In the orbit plane: p towards the perigee, q a quarter turn ahead.
  const double minor = std::sqrt((1.0 - e) * (1.0 + e));
  const double cos_e = std::cos(e_anomaly);
  const double sin_e = std::sin(e_anomaly);
  const double rate = a_m * n / (1.0 - e * cos_e);
  OrbitState state;
  state.position.m = a_m * ((cos_e - e) * toward_perigee_ + minor * sin_e * quarter_turn_ahead_);
  state.velocity.m_s = rate * (-sin_e * toward_perigee_ + minor * cos_e * quarter_turn_ahead_);
  return state;
}

}  // namespace engine
