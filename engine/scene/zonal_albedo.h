#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace engine {

/// The share of sunlight that the Earth sends back, clouds and air included, by latitude: a series
/// of Legendre polynomials in its sine.
struct ZonalAlbedo {
  std::array<double, 3> legendre{0.3, 0.0, 0.0};

  [[nodiscard]] double at(double sin_latitude) const noexcept {
    const double s = sin_latitude;
    return legendre[0] + s * legendre[1] + 0.5 * (3.0 * s * s - 1.0) * legendre[2];
  }
  /// Of a parabola, at an end or where it is flat.
  [[nodiscard]] double largest_between(double sin_south, double sin_north) const noexcept {
    double most = std::max(at(sin_south), at(sin_north));
    const double flat_at = -legendre[1] / (3.0 * legendre[2]);
    if (sin_south < flat_at && flat_at < sin_north) most = std::max(most, at(flat_at));
    return most;
  }
  /// On the whole Earth.
  [[nodiscard]] double largest() const noexcept { return largest_between(-1.0, 1.0); }
};

}  // namespace engine
