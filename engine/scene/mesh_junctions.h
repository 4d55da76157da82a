#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/mesh.h"
#include "engine/scene/mesh_topology.h"

namespace engine {

/// Vertices that lie in the middle of another triangle's edge (T-junctions): faces seem to meet
/// there, but share no edge, and between them a ray may slip through.
struct MeshJunctions {
  struct Junction {
    std::uint32_t vertex = 0;
    std::uint32_t triangle = 0;  ///< whose edge it lies in: of several edges, one
  };
  std::vector<Junction> found;  ///< each vertex once; rising
  bool complete = true;         ///< or there may be more: it gave up
};

/// Of the ends of open edges, those not further than `weld_m` from another open edge, its ends
/// apart: a junction leaves open what meets there. Takes time in proportion to n log n of the open
/// edges; where very many lie across one another, or there are over a million, it gives up.
/// Pre: vertices are welded: no two of them are as close as that.
[[nodiscard]] MeshJunctions junctions_of(const Mesh& mesh, const MeshTopology& topology,
                                         double weld_m);

}  // namespace engine
