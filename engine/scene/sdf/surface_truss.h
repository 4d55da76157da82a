#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/sdf/marching.h"
#include "engine/scene/sdf/planar_truss.h"
#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// A smooth surface that vertices stay on: its distance, and its normal, outwards and unit.
struct Sheet {
  DistanceFunction distance_m;
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> normal;
};
/// Of a function of which nothing but its value is known: the normal by differences.
[[nodiscard]] Sheet sheet_of(const DistanceFunction& f, double step_m);
/// By Newton's method along the normal, no further than `reach_m`. False where it does not get
/// there: the point stays.
bool settle_on(const Sheet& sheet, double reach_m, Eigen::Vector3d& p_m);

/// A raw surface as a mesh of about the size wanted: of its vertices as many stay as the size
/// function wants to an area, by rejection; the others are collapsed onto a neighbour.
[[nodiscard]] WorkMesh thinned(const MarchedSurface& raw, const SizeFunction& size_m,
                               std::uint64_t seed);

/// Evens out a surface: bars push where they are too short, in the tangent plane; what leaves its
/// sheet is pulled back along the distance's slope; edges are flipped to Delaunay's, split where
/// they are much too long and collapsed where much too short (Persson 2005, "Mesh generation for
/// implicit geometries", for the truss; Botsch & Kobbelt 2004, "A remeshing approach to
/// multiresolution modeling", for splits and collapses). Held vertices and locked edges stay.
[[nodiscard]] TrussReport relax(WorkMesh& mesh, const std::vector<Sheet>& sheets,
                                const SizeFunction& size_m, int most_iterations);

/// Makes the worst triangles better: by flips, by moving a vertex, by collapsing the shortest edge.
/// What it leaves under `wanted` it could not mend.
void mend(WorkMesh& mesh, const std::vector<Sheet>& sheets, double wanted);

}  // namespace engine
