#pragma once

#include <vector>

#include "engine/scene/mesh.h"
#include "engine/scene/mesh_topology.h"

namespace engine {

/// Which triangles to turn round so that each piece of a mesh faces one way.
struct Facing {
  std::vector<bool> turn;  ///< by triangle
  std::size_t closed_pieces = 0;
  std::size_t one_sided = 0;   ///< pieces that have no two sides
  std::size_t not_looked = 0;  ///< open pieces that rays were not cast from: it took too long
  double volume_m3 = 0;        ///< of the closed pieces, once they are turned
};

/// A closed piece faces outwards, by the sign of its volume; an open one to the side that more rays
/// leave the mesh from (MeshOutside: the largest first), or where neither does, or it would take
/// too long, as most of its area does; one with a single side stays. A closed piece that faces
/// inwards all over, within the box of a larger one that does not, stays too: it may be the wall of
/// a cavity.
[[nodiscard]] Facing facing_of(const Mesh& mesh, const MeshTopology& topology);

}  // namespace engine
