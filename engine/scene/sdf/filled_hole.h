#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// A closed line of vertices as triangles, the worst of them as good as can be: the best triangle
/// on each stretch, then on longer ones (Barequet & Sharir 1995, "Filling gaps in the boundary of a
/// polyhedron"). The cube of its length in work: for small holes.
[[nodiscard]] std::vector<Corners> filled_hole(const WorkMesh& mesh,
                                               const std::vector<std::uint32_t>& hole);

}  // namespace engine
