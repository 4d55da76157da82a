#pragma once

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/vec.h"

namespace engine {

/// Integral of f(in, out) cos_out over the hemisphere, for light at this cosine from x below 0:
/// over the disc that the hemisphere projects to, in rings that are fine about the mirror direction
/// and end on the horizon. Pre: f is the same on both sides of the plane of incidence.
template <int kRings, int kTurns, class F>
[[nodiscard]] double hemisphere_integral(double cos_in, const F& f) {
  const double sin_in = std::sqrt(1.0 - cos_in * cos_in);
  const Eigen::Vector3d in(-sin_in, 0.0, cos_in);
  double sum = 0;
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

}  // namespace engine
