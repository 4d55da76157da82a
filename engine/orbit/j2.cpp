#include "engine/orbit/j2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace engine {
namespace {

constexpr Duration kShortestStep{1000};

template <std::size_t Terms>
using Series = std::array<double, Terms>;

/// Term k of a product. Two sums side by side: one would wait for each of its additions.
template <std::size_t Terms>
double product(const Series<Terms>& a, const Series<Terms>& b, std::size_t k) noexcept {
  double even = a[0] * b[k];
  double odd = 0;
  for (std::size_t i = 1; i < k; i += 2) {
    odd += a[i] * b[k - i];
    even += a[i + 1] * b[k - i - 1];
  }
  return k % 2 == 1 ? even + (odd + a[k] * b[0]) : even + odd;
}

/// Term k of a square: each product of two different terms is there twice.
template <std::size_t Terms>
double square(const Series<Terms>& a, std::size_t k) noexcept {
  double sum = 0;
  for (std::size_t i = 0; 2 * i < k; ++i) sum += a[i] * a[k - i];
  return k % 2 == 1 ? 2.0 * sum : 2.0 * sum + a[k / 2] * a[k / 2];
}

/// Term k >= 1 of s to a power, its terms before that being known.
template <std::size_t Terms>
double power(const Series<Terms>& s, const Series<Terms>& p, double exponent,
             std::size_t k) noexcept {
  double sum = 0;
  for (std::size_t i = 1; i <= k; ++i)
    sum += (static_cast<double>(i) * (exponent + 1.0) - static_cast<double>(k)) * s[i] * p[k - i];
  return sum / (static_cast<double>(k) * s[0]);
}

}  // namespace

double energy_j_kg(const OrbitState& state, const OblateEarth& earth) noexcept {
  const double r = state.position.m.norm();
  const double sine = state.position.m.z() / r;  // of the latitude
  const double flat = earth.radius_m / r;
  const double bulge = 0.5 * earth.j2 * flat * flat * (3.0 * sine * sine - 1.0);
  return 0.5 * state.velocity.m_s.squaredNorm() - earth.mu_m3_s2 / r * (1.0 - bulge);
}

J2Propagator::J2Propagator(const OrbitState& state, Epoch epoch, const EpochSpan& span,
                           const OblateEarth& earth)
    : span_(span) {
  std::vector<Leg> before;
  if (span.begin < epoch) before = integrate(state, epoch, span.begin, earth);
  std::vector<Leg> after = integrate(state, epoch, span.end, earth);
  // A leg backwards begins where the next one, further back, has its origin.
  for (std::size_t i = before.size(); i-- > 0;)
    begins_.push_back(i + 1 < before.size() ? before[i + 1].origin : span.begin);
  for (const Leg& leg : after) begins_.push_back(leg.origin);
  legs_.assign(std::make_move_iterator(before.rbegin()), std::make_move_iterator(before.rend()));
  legs_.insert(legs_.end(), std::make_move_iterator(after.begin()),
               std::make_move_iterator(after.end()));
}

OrbitState J2Propagator::at(Epoch t) const noexcept {
  t = std::clamp(t, span_.begin, span_.end);
  const auto next = std::upper_bound(begins_.begin(), begins_.end(), t);
  return legs_[static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - begins_.begin(), 1) - 1)]
      .at(t);
}

OrbitState J2Propagator::Leg::at(Epoch t) const noexcept {
  const Terms::Motion motion = m.at(seconds(t - origin));
  return {{motion.value}, {motion.rate}};
}

J2Propagator::Terms J2Propagator::expand(const OrbitState& state,
                                         const OblateEarth& earth) noexcept {
  const double bulge = 1.5 * earth.j2 * earth.mu_m3_s2 * earth.radius_m * earth.radius_m;
  Series<kOrder + 1> x{state.position.m.x(), state.velocity.m_s.x()};
  Series<kOrder + 1> y{state.position.m.y(), state.velocity.m_s.y()};
  Series<kOrder + 1> z{state.position.m.z(), state.velocity.m_s.z()};
  Series<kOrder + 1> s;      // r^2
  Series<kOrder + 1> z2;     // z^2
  Series<kOrder + 1> cube;   // r^-3
  Series<kOrder + 1> one;    // r^-2
  Series<kOrder + 1> fifth;  // r^-5
  Series<kOrder + 1> sine2;  // z^2 / r^2
  Series<kOrder + 1> f;      // acceleration = -(x f, y f, z g)
  Series<kOrder + 1> g;
  for (std::size_t k = 0; k + 2 <= kOrder; ++k) {
    z2[k] = square(z, k);
    s[k] = square(x, k) + square(y, k) + z2[k];
    cube[k] = k == 0 ? 1.0 / (s[0] * std::sqrt(s[0])) : power(s, cube, -1.5, k);
    one[k] = k == 0 ? 1.0 / s[0] : power(s, one, -1.0, k);
    fifth[k] = product(cube, one, k);
    sine2[k] = product(z2, one, k);
    f[k] = earth.mu_m3_s2 * cube[k] + bulge * (fifth[k] - 5.0 * product(fifth, sine2, k));
    g[k] = f[k] + 2.0 * bulge * fifth[k];
    const double twice = static_cast<double>((k + 1) * (k + 2));
    x[k + 2] = -product(x, f, k) / twice;
    y[k + 2] = -product(y, f, k) / twice;
    z[k + 2] = -product(z, g, k) / twice;
  }
  std::array<Eigen::Vector3d, kOrder + 1> terms;
  for (std::size_t k = 0; k <= kOrder; ++k) terms[k] = {x[k], y[k], z[k]};
  return Terms(terms);
}

std::vector<J2Propagator::Leg> J2Propagator::integrate(OrbitState state, Epoch t, Epoch end,
                                                       const OblateEarth& earth) {
  const int way = end < t ? -1 : 1;
  std::vector<Leg> legs;
  do {
    const Leg leg{t, expand(state, earth)};
    const bool last = leg.m.reach_s() >= std::abs(seconds(end - t));
    const Duration whole = last ? (end - t) * way : from_seconds(leg.m.reach_s());
    const Duration step = way * std::max(kShortestStep, whole);
    // Often enough that no perigee between is faster by more than the margin.
    constexpr int kLooks = 4;
    for (int i = 0; i <= kLooks; ++i)
      fastest_m_s_ =
          std::max(fastest_m_s_, 1.01 * leg.at(t + step * i / kLooks).velocity.m_s.norm());
    t = last ? end : t + step;
    state = leg.at(t);
    legs.push_back(leg);
  } while (t != end);
  return legs;
}

}  // namespace engine
