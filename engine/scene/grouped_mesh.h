#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/scene/mesh.h"

namespace engine {

/// A mesh as a file describes it: each triangle belongs to a named group, which may be moved by
/// itself (a solar panel) before rays see any of it.
struct GroupedMesh {
  Mesh mesh;
  std::vector<std::string> group_names;
  std::vector<std::uint32_t> group;  ///< by triangle: index into group_names

  /// The triangles of some groups and no other vertex than theirs; the mesh itself where that is
  /// all of them. Materials keep their index. Pre: wanted has a place for each group.
  [[nodiscard]] Mesh part(const std::vector<bool>& wanted) const;
};

}  // namespace engine
