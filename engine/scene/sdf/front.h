#pragma once

#include <cstddef>
#include <string>

#include "engine/scene/sdf/features.h"
#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// Meshes a shape between its creases by an advancing front, smallest angle first: creases are
/// divided, so that corners and edges are exact, and each sheet is filled from them inwards, a
/// triangle at a time, always at the front's sharpest corner.
///
/// After Hartmann 1998, "A marching method for the triangulation of surfaces", DOI
/// 10.1007/s003710050126, for points on surfaces of zero distance, and Lo 1985, "A new mesh
/// generation scheme for arbitrary planar domains", for a front that starts at the border.
/// Sheets without a crease are left out: FeatureGraph::seamless.
struct FrontReport {
  std::size_t triangles = 0;
  std::string failed;  ///< why a front did not close; empty when all did
};
/// Adds to the mesh: creases are locked, their vertices held. `solid` is null for a plane region.
[[nodiscard]] FrontReport fill_by_front(const FeatureGraph& graph, const Solid* solid,
                                        const SizeFunction& size_m, std::size_t most_triangles,
                                        WorkMesh& mesh);

}  // namespace engine
