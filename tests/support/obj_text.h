#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "engine/scene/mesh_repair.h"
#include "engine/scene/obj_file.h"

/// Meshes from the text of an OBJ file, as a scenario would get them.
namespace test_support {

struct LoadedObj {
  engine::GroupedMesh grouped;
  engine::MeshReport report;
  [[nodiscard]] const engine::Mesh& mesh() const { return grouped.mesh; }
  [[nodiscard]] std::string material(std::size_t triangle) const {
    return mesh().material_names[mesh().triangles[triangle].material];
  }
  [[nodiscard]] std::string group(std::size_t triangle) const {
    return grouped.group_names[grouped.group[triangle]];
  }
};

[[nodiscard]] inline LoadedObj load_obj(std::string_view text) {
  LoadedObj loaded;
  engine::ObjFile file = engine::obj_from_text(text, "mesh.obj", loaded.report);
  engine::repair(file.grouped, std::move(file.line), loaded.report);
  loaded.grouped = std::move(file.grouped);
  return loaded;
}

inline constexpr const char* kUnitSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
inline constexpr const char* kCubeCorners =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
/// Outwards; on lines 9 to 14 after the corners.
inline constexpr const char* kCubeFaces =
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

}  // namespace test_support
