#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/grouped_mesh.h"
#include "engine/scene/mesh_report.h"

namespace engine {

/// What an OBJ file holds, in its own units and axes, before anything is mended.
struct ObjFile {
  GroupedMesh grouped;              ///< a vertex that is no number is three NaN
  std::vector<std::uint32_t> line;  ///< of the file, by triangle
};

/// Reads an OBJ file: triangles, quads, and polygons, with its groups and materials by name.
///
/// A group is named by the last `g` or `o` before a face, whichever; the same name later on is the
/// same group. A material is named by `usemtl`; the MTL file is not opened: how a surface reflects
/// at the camera's wavelengths is the scenario's to say, colours for a screen do not tell it. So a
/// missing one is no loss. Names without a statement are "default".
/// Leaves out: curves, lines, points, texture coordinates, and normals, which the renderer makes
/// itself.
///
/// Throws ConfigError, "file:line: ...": no file, no text, a malformed statement, an index outside
/// the file, no face, over 1 GiB, over 10 million vertices or corners.
[[nodiscard]] ObjFile read_obj(const std::string& path, MeshReport& report);
/// The same of a text; `name` is for complaints.
[[nodiscard]] ObjFile obj_from_text(std::string_view text, const std::string& name,
                                    MeshReport& report);

}  // namespace engine
