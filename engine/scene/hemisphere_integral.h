#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>

#include "engine/core/constants.h"
#include "engine/core/vec.h"

namespace engine {

namespace detail {
template <class Value>
[[nodiscard]] Value nothing_of() {
  if constexpr (std::is_arithmetic_v<Value>)
    return Value{};
  else
    return Value::Zero();
}
}  // namespace detail

/// Integral of f(in, out) cos_out over the hemisphere, for light at this cosine from x below 0:
/// over the disc that the hemisphere projects to, in rings that are fine about the mirror direction
/// and end on the horizon. A lobe of a degree that is elsewhere falls between them: name it to the
/// other one. f gives numbers or fixed vectors of them. Pre: f is the same on both sides of the
/// plane of incidence.
template <int kRings, int kTurns, class F>
[[nodiscard]] auto hemisphere_integral(double cos_in, const F& f) {
  const double sin_in = std::sqrt(1.0 - cos_in * cos_in);
  const Eigen::Vector3d in(-sin_in, 0.0, cos_in);
  auto sum = detail::nothing_of<std::invoke_result_t<F, Eigen::Vector3d, Eigen::Vector3d>>();
  for (int turn = 0; turn < kTurns; ++turn) {
    const double azimuth = kPi * (turn + 0.5) / kTurns;
    const double across = sin_in * std::sin(azimuth);
    const double reach = std::sqrt(1.0 - across * across) - sin_in * std::cos(azimuth);
    for (int ring = 0; ring < kRings; ++ring) {
      const double t = (ring + 0.5) / kRings;
      const double r = reach * t * t * t;
      const double dr = reach * 3.0 * t * t / kRings;
      const double x = sin_in + r * std::cos(azimuth);
      const double y = r * std::sin(azimuth);
      const Eigen::Vector3d out(x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y)));
      sum += f(in, out) * r * dr * 2.0 * kPi / kTurns;
    }
  }
  return sum;
}

/// The same, with rings that are fine about further directions too: each set of rings counts most
/// where it is the finest, and together they count everything once.
template <int kRings, int kTurns, class F>
[[nodiscard]] auto hemisphere_integral(double cos_in, std::span<const Eigen::Vector3d> poles,
                                       const F& f) {
  const double sin_in = std::sqrt(1.0 - cos_in * cos_in);
  const Eigen::Vector3d in(-sin_in, 0.0, cos_in);
  // Of one set of rings at a direction, before they are made to be 1 in all.
  const auto claim = [](double x, double y, const Eigen::Vector3d& out) {
    const double d2 = (out.x() - x) * (out.x() - x) + (out.y() - y) * (out.y() - y) + 1e-12;
    return 1.0 / (d2 * d2);
  };
  const auto all_claims = [&](const Eigen::Vector3d& out) {
    double sum = claim(sin_in, 0.0, out);
    for (const Eigen::Vector3d& pole : poles) {
      sum += claim(pole.x(), pole.y(), out);
      if (pole.y() != 0.0) sum += claim(pole.x(), -pole.y(), out);
    }
    return sum;
  };
  using Value = std::invoke_result_t<F, Eigen::Vector3d, Eigen::Vector3d>;
  auto sum = hemisphere_integral<kRings, kTurns>(
      cos_in, [&](const Eigen::Vector3d& from, const Eigen::Vector3d& out) -> Value {
        return f(from, out) * (claim(sin_in, 0.0, out) / all_claims(out));
      });
  for (const Eigen::Vector3d& pole : poles) {
    // Half a turn about one in the plane of incidence; a whole one about one beside it, and none
    // about its mirror image.
    const int turns = pole.y() == 0.0 ? kTurns / 2 : kTurns;
    for (int turn = 0; turn < turns; ++turn) {
      const double azimuth = 2.0 * kPi * (turn + 0.5) / kTurns;
      const double along = pole.x() * std::cos(azimuth) + pole.y() * std::sin(azimuth);
      const double off2 = pole.x() * pole.x() + pole.y() * pole.y() - along * along;
      const double reach = std::sqrt(std::max(0.0, 1.0 - off2)) - along;
      for (int ring = 0; ring < kRings; ++ring) {
        const double t = (ring + 0.5) / kRings;
        const double r = reach * t * t * t;
        const double dr = reach * 3.0 * t * t / kRings;
        const double x = pole.x() + r * std::cos(azimuth);
        const double y = pole.y() + r * std::sin(azimuth);
        const Eigen::Vector3d out(x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y)));
        const double share = claim(pole.x(), pole.y(), out) / all_claims(out);
        sum += f(in, out) * (share * r * dr * 4.0 * kPi / kTurns);
      }
    }
  }
  return sum;
}

}  // namespace engine
