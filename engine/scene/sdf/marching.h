#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "engine/scene/sdf/delaunay.h"
#include "engine/scene/sdf/solid.h"

namespace engine {

/// What was met on the way.
struct MarchReport {
  double step_m = 0;                ///< the cells' side
  std::size_t not_finite = 0;       ///< places where the function gave no number: taken for outside
  std::size_t unresolved = 0;       ///< edges of the lattice that cross the surface twice
  std::size_t inside_at_sides = 0;  ///< places on the box's sides that are inside: cut off there
};

/// The surface of a body by marching tetrahedra: each cell of a lattice is cut into six, and each
/// of these cuts off its corners that are inside (Payne & Toga 1990, "Surface mapping brain
/// function on 3D models"). Closed, with outside outside, whatever the function says: a number that
/// is none is outside, and so is all beyond the box. Triangles are uneven, slivers too; edges are
/// cut off.
struct MarchedSurface {
  std::vector<Eigen::Vector3d> places_m;
  std::vector<Corners> triangles;
  MarchReport report;
};
/// Cells of at least `step_m`, more where there would be over four million; twice as fine, up to
/// twice, where the surface comes back between two places of the lattice.
[[nodiscard]] MarchedSurface marched_surface(const DistanceFunction& f,
                                             const Eigen::AlignedBox3d& box_m, double step_m);

/// Of a region of the plane z = 0: its inside in triangles, by cutting a lattice of even ones at
/// the border. Where the border comes within a quarter of a lattice point, that point is moved onto
/// it (isosurface stuffing, Labelle & Shewchuk 2007, DOI 10.1145/1276377.1276448), so that no
/// triangle is a sliver.
[[nodiscard]] MarchedSurface stuffed_region(const DistanceFunction& f,
                                            const Eigen::AlignedBox3d& box_m, double step_m);

}  // namespace engine
