#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "engine/scene/mesh.h"
#include "engine/scene/sdf/mesh_figures.h"
#include "engine/scene/sdf/solid.h"
#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// A shape to be meshed, given by its signed distance: a closed surface, or a region of the plane
/// z = 0.
///
/// The distance may be any function, also one that is none: scaled, not a number in places, empty.
/// Edges and corners are exact only where they are known: of a Solid, or of polygons.
struct SdfShape {
  DistanceFunction distance_m;
  Eigen::AlignedBox3d box_m;  ///< holds it all
  bool is_region = false;
  std::shared_ptr<const Solid> solid;                 ///< whose edges can be found; may be null
  std::vector<std::vector<Eigen::Vector3d>> loops_m;  ///< a region's border, inside on the left
};
[[nodiscard]] SdfShape surface_of(const Solid& solid);
/// A surface, or a region, of which nothing is known but the function.
[[nodiscard]] SdfShape surface_of(DistanceFunction distance_m, const Eigen::AlignedBox3d& box_m);
[[nodiscard]] SdfShape region_of(DistanceFunction distance_m, const Eigen::AlignedBox3d& box_m);
/// Between polygons: the outer ones run anticlockwise, holes clockwise. The distance is exact.
[[nodiscard]] SdfShape region_of(const std::vector<std::vector<Eigen::Vector3d>>& loops_m);

enum class SdfMethod : std::uint8_t {
  kAuto,    ///< front where edges are known, else truss
  kTruss,   ///< seeds by rejection, Delaunay, balance of forces: for smooth borders
  kFront,   ///< advancing from the edges inwards, smallest angle first
  kLattice  ///< marching tetrahedra, or stuffed triangles: cuts off edges, but cannot fail
};
[[nodiscard]] const char* name_of(SdfMethod method) noexcept;

/// Work is bounded by counts, never by a clock: the same result everywhere.
struct SdfMeshSpec {
  SizeFunction size_m;    ///< how long edges should be
  double smallest_m = 0;  ///< the size function's smallest value, > 0
  SdfMethod method = SdfMethod::kAuto;
  int most_iterations = 300;
  std::size_t most_triangles = 400'000;
  std::uint64_t seed = 1;
  bool fall_back = true;  ///< false: what failed is kept, to be looked at
};
[[nodiscard]] SdfMeshSpec even_edges(double edge_m, SdfMethod method = SdfMethod::kAuto);

struct SdfMesh {
  std::vector<Eigen::Vector3d> places_m;
  std::vector<Corners> triangles;
  SdfMethod method = SdfMethod::kAuto;  ///< that made it
  int iterations = 0;
  int triangulations = 0;          ///< rounds of Delaunay, or of flips
  bool settled = false;            ///< the truss came to rest
  std::string fell_back;           ///< why the method asked for did not do; empty when it did
  std::vector<std::string> notes;  ///< what is odd about the shape, for its user
  MeshFigures figures;

  [[nodiscard]] Mesh as_mesh(const std::string& material) const;
};

/// Meshes a shape, and says what was reached. Never throws for a shape that is bad, never hangs:
/// what cannot be meshed as asked ends with `fell_back` and the mesh of the lattice; of an empty
/// shape the mesh is empty and a note says so. No triangle's radius ratio is under .1 but where the
/// shape's own angles are that sharp, or a note says how many are.
///
/// Li et al. 2023, section 1.2.1, DOI 10.3788/IRLA20230351: both methods, and which is for what.
[[nodiscard]] SdfMesh mesh_shape(const SdfShape& shape, const SdfMeshSpec& spec);

}  // namespace engine
