#pragma once

#include "engine/core/vec.h"

namespace engine {

/// Directions in a surface's own frame, whose z is the normal: what models of its light share.

/// Below this cosine a facet is edge-on: it shows nothing, and 1/cos would only make noise of it.
inline constexpr double kGrazing = 1e-6;

/// 1 - cos of the angle between two unit vectors. From the difference: a lobe is a cusp one
/// degree wide, and 1 - dot would lose it to rounding.
[[nodiscard]] inline double one_minus_cos(const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b) noexcept {
  return 0.5 * (a - b).squaredNorm();
}
/// Where a mirror sends what comes along `v`.
[[nodiscard]] inline Eigen::Vector3d mirrored(const Eigen::Vector3d& v) noexcept {
  return {-v.x(), -v.y(), v.z()};
}

}  // namespace engine
