#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "engine/scene/sdf/delaunay.h"
#include "engine/scene/sdf/solid.h"
#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// How a truss came to rest, or not. Limits are counts, never a clock: the same everywhere.
struct TrussReport {
  int iterations = 0;
  int triangulations = 0;
  double last_move = 0;  ///< the largest of a point inside, in edges
  bool settled = false;  ///< it fell under the threshold
  bool gave_up = false;  ///< it fell no more over many iterations
};

struct PlanarTruss {
  std::vector<Eigen::Vector3d> places_m;
  std::vector<Corners> triangles;
  TrussReport report;
};

/// The inside of a plane region in even triangles: points by rejection against the size function,
/// Delaunay triangles, bars that push where they are too short, and points that leave the region
/// pulled back along the distance's slope. Persson & Strang 2004, "A simple mesh generator in
/// MATLAB", DOI 10.1137/S0036144503429121, with their constants.
///
/// We differ in when it ends: also when the largest move has not fallen for fifty iterations, for a
/// distance that is none beyond corners (a maximum of planes) sends points round in circles.
/// `smallest_m` is the size function's smallest value; `fixed` stay where they are.
[[nodiscard]] PlanarTruss planar_truss(const DistanceFunction& f, const SizeFunction& size_m,
                                       double smallest_m, const Eigen::AlignedBox3d& box_m,
                                       const std::vector<Eigen::Vector3d>& fixed,
                                       int most_iterations, std::uint64_t seed);

}  // namespace engine
