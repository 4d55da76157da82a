#include "engine/scene/grouped_mesh.h"

#include <algorithm>
#include <limits>

namespace engine {

Mesh GroupedMesh::part(const std::vector<bool>& wanted) const {
  if (std::ranges::all_of(wanted, [](bool w) { return w; })) return mesh;
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> moved_to(mesh.vertices.size(), kUnused);
  Mesh part;
  part.material_names = mesh.material_names;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!wanted[group[t]]) continue;
    Mesh::Triangle triangle = mesh.triangles[t];
    for (std::uint32_t& corner : triangle.corner) {
      if (moved_to[corner] == kUnused) {
        moved_to[corner] = static_cast<std::uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[corner]);
      }
      corner = moved_to[corner];
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

}  // namespace engine
