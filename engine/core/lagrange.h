#pragma once

#include <array>

namespace engine {

/// Weights of Lagrange's cubic through four places -1, 0, 1, 2 at t in [0, 1).
[[nodiscard]] constexpr std::array<float, 4> lagrange_cubic(double t) noexcept {
  const double a = t + 1.0;
  const double b = t - 1.0;
  const double c = t - 2.0;
  return {static_cast<float>(-t * b * c / 6.0), static_cast<float>(a * b * c / 2.0),
          static_cast<float>(-a * t * c / 2.0), static_cast<float>(a * t * b / 6.0)};
}

}  // namespace engine
