#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/sdf/delaunay.h"
#include "engine/scene/sdf/solid.h"

namespace engine {

/// What a mesh is worth.
struct MeshFigures {
  static constexpr std::size_t kBins = 20;
  std::size_t vertices = 0;  ///< that a triangle has
  std::size_t edges = 0;
  std::size_t triangles = 0;
  std::size_t rims = 0;         ///< edges of one triangle only
  std::size_t tangled = 0;      ///< edges of more than two, or walked the same way by both
  int euler = 0;                ///< vertices - edges + triangles: 2 a sphere, 0 a torus
  double smallest_quality = 0;  ///< radius ratio, in [0, 1]
  double mean_quality = 0;
  std::array<std::size_t, kBins> histogram{};  ///< of the quality, from 0 to 1
  double area_m2 = 0;
  double volume_m3 = 0;  ///< positive with outside outside; of a closed mesh
  double off_m = 0;      ///< the furthest that a vertex, an edge's or a triangle's middle is off

  /// Every edge is walked once each way.
  [[nodiscard]] bool closed() const noexcept { return triangles > 0 && rims == 0 && tangled == 0; }
};
/// `f` may be empty: then nothing is off.
[[nodiscard]] MeshFigures figures_of(const std::vector<Eigen::Vector3d>& places_m,
                                     const std::vector<Corners>& triangles,
                                     const DistanceFunction& f);

}  // namespace engine
