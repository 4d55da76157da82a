#include "engine/orbit/tumbling_body.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Of the rate's cycle: 2 pi over the frequency of small swings, and the ratio of the two sides of
/// the arithmetic-geometric mean. Without cancellation, by the differences of the moments.
double cycle_of(const Vector3d& inertia, const Vector3d& rate) noexcept {
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) { return inertia[a] < inertia[b]; });
  const double i1 = inertia[order[0]];
  const double i2 = inertia[order[1]];
  const double i3 = inertia[order[2]];
  const double w1 = i1 * std::pow(rate[order[0]], 2);
  const double w2 = i2 * std::pow(rate[order[1]], 2);
  const double w3 = i3 * std::pow(rate[order[2]], 2);
  // L^2 - 2 E I1, 2 E I3 - L^2, and the sign of L^2 - 2 E I2, which says about which axis it goes.
  const double above = w2 * (i2 - i1) + w3 * (i3 - i1);
  const double below = w1 * (i3 - i1) + w2 * (i3 - i2);
  const double side = w3 * (i3 - i2) - w1 * (i2 - i1);
  const double large = std::max((i3 - i2) * above, (i2 - i1) * below);
  const double speed = std::sqrt(large / (i1 * i2 * i3));
  double a = 1.0;
  double b = std::sqrt((i3 - i1) * std::abs(side) / large);  // the complementary modulus
  for (int i = 0; i < 40 && std::abs(a - b) > 1e-16 * a; ++i) {
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
  }
  return 2.0 * kPi / (speed * a);
}

/// Whether the rate stays as it is: about a principal axis, or of a ball.
bool turns_evenly(const Vector3d& inertia, const Vector3d& rate) noexcept {
  const Vector3d momentum = inertia.cwiseProduct(rate);
  return !(momentum.cross(rate).norm() > 1e-14 * momentum.norm() * rate.norm());
}

}  // namespace

TumblingBody::TumblingBody(const Vector3d& inertia, const Vector3d& rate_rad_s,
                           const Quaterniond& j2000_from_body)
    : pull_((inertia.y() - inertia.z()) / inertia.x(), (inertia.z() - inertia.x()) / inertia.y(),
            (inertia.x() - inertia.y()) / inertia.z()),
      start_{j2000_from_body, rate_rad_s},
      turn_(0.0, Vector3d::UnitZ()) {
  if (turns_evenly(inertia, rate_rad_s)) return;
  cycle_s_ = cycle_of(inertia, rate_rad_s);
  Leg::Vector state;
  state << j2000_from_body.coeffs(), rate_rad_s;
  double t_s = 0;
  while (t_s < cycle_s_) {
    legs_.push_back(expand(state));
    begins_s_.push_back(t_s);
    const double step_s = std::min(legs_.back().reach_s(), cycle_s_ - t_s);
    state = legs_.back().at(step_s).value;
    state.head<4>().normalize();
    t_s = step_s < legs_.back().reach_s() ? cycle_s_ : t_s + step_s;
  }
  turn_ = Eigen::AngleAxisd(turned(state).j2000_from_body * j2000_from_body.conjugate());
}

double TumblingBody::cycle_steps(const Vector3d& inertia, const Vector3d& rate) noexcept {
  // Two steps to a radian, and more than enough.
  return turns_evenly(inertia, rate) ? 0.0 : 2.0 * cycle_of(inertia, rate) * rate.norm();
}

TumblingBody::Turned TumblingBody::turned(const Leg::Vector& state) noexcept {
  return {Quaterniond(Eigen::Vector4d(state.head<4>())).normalized(), state.tail<3>()};
}

TumblingBody::Leg TumblingBody::expand(const Leg::Vector& state) const noexcept {
  std::array<Leg::Vector, kOrder + 1> terms;
  terms[0] = state;
  for (std::size_t k = 0; k < kOrder; ++k) {
    Leg::Vector sum = Leg::Vector::Zero();
    for (std::size_t i = 0; i <= k; ++i) {
      const Leg::Vector& a = terms[i];
      const Leg::Vector& b = terms[k - i];
      const Vector3d w = b.tail<3>();
      const Vector3d v = a.head<3>();
      // Half the quaternion times (w, 0).
      sum.head<3>() += 0.5 * (a[3] * w + v.cross(w));
      sum[3] -= 0.5 * v.dot(w);
      sum[4] += pull_.x() * a[5] * b[6];
      sum[5] += pull_.y() * a[6] * b[4];
      sum[6] += pull_.z() * a[4] * b[5];
    }
    terms[k + 1] = sum / static_cast<double>(k + 1);
  }
  return Leg(terms);
}

TumblingBody::Turned TumblingBody::at(double t_s) const noexcept {
  if (legs_.empty()) {
    const double speed = start_.rate_rad_s.norm();
    if (!(speed > 0.0)) return start_;
    const Eigen::AngleAxisd turn(std::remainder(speed * t_s, 2.0 * kPi), start_.rate_rad_s / speed);
    return {start_.j2000_from_body * turn, start_.rate_rad_s};
  }
  const double cycles = std::floor(t_s / cycle_s_);
  const double within_s = std::clamp(t_s - cycles * cycle_s_, 0.0, cycle_s_);
  const auto next = std::upper_bound(begins_s_.begin(), begins_s_.end(), within_s);
  const auto leg = static_cast<std::size_t>(next - begins_s_.begin()) - 1;
  Turned now = turned(legs_[leg].at(within_s - begins_s_[leg]).value);
  const Eigen::AngleAxisd turns(std::remainder(cycles * turn_.angle(), 2.0 * kPi), turn_.axis());
  now.j2000_from_body = turns * now.j2000_from_body;
  return now;
}

}  // namespace engine
