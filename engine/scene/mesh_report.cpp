#include "engine/scene/mesh_report.h"

#include <cstdio>

namespace engine {
namespace {

/// "12 open edges (lines 7, 9, 11, ...)"
void tell(std::vector<std::string>& lines, const MeshDefect& defect, const std::string& what,
          const std::string& more = "") {
  if (defect.count == 0) return;
  std::string text = std::to_string(defect.count) + " " + what;
  if (!defect.lines.empty()) {
    text += defect.lines.size() == 1 ? " (line " : " (lines ";
    for (std::size_t i = 0; i < defect.lines.size(); ++i)
      text += (i > 0 ? ", " : "") + std::to_string(defect.lines[i]);
    text += defect.count > defect.lines.size() && defect.lines.size() == MeshDefect::kMostLines
                ? ", ...)"
                : ")";
  }
  lines.push_back(text + more);
}

}  // namespace

void MeshDefect::add(std::uint32_t line) {
  ++count;
  if (line != 0 && lines.size() < kMostLines && (lines.empty() || lines.back() != line))
    lines.push_back(line);
}

bool MeshReport::clean() const noexcept {
  return left_out() + flipped.count + tangled.count + open_edges.count + non_manifold_edges.count ==
         0;
}

std::vector<std::string> MeshReport::repairs() const {
  std::vector<std::string> lines;
  tell(lines, few_corners, "faces of under three corners left out");
  tell(lines, not_finite, "faces with a corner that is no number left out");
  tell(lines, zero_area, "faces left out, whole or in part, for want of area");
  tell(lines, duplicate, "faces on the corners of an earlier one left out",
       duplicate_of_other_material == 0 ? ""
                                        : ": " + std::to_string(duplicate_of_other_material) +
                                              " of another material, the first one's stays");
  tell(lines, flipped, "faces turned round to face as their neighbours, or outwards");
  tell(lines, tangled, "polygons that cross themselves");
  if (welded > 0) {
    char text[120];
    std::snprintf(text, sizeof text, "%zu vertices became one with another within %.2g m", welded,
                  weld_m);
    lines.emplace_back(text);
  }
  return lines;
}

std::vector<std::string> MeshReport::remarks() const {
  std::vector<std::string> lines;
  tell(lines, open_edges, "open edges");
  tell(lines, non_manifold_edges, "edges of more than two faces");
  tell(lines, t_junctions, "vertices in the middle of another face's open edge");
  if (!t_junctions_complete)
    lines.emplace_back(
        "too many open edges, or across one another, to find every vertex in the middle of one");
  tell(lines, slivers, "triangles over 1000 times as long as they are high");
  if (not_looked > 0)
    lines.push_back(std::to_string(not_looked) +
                    " open pieces whose outside was not looked for: too many");
  if (one_sided > 0) lines.push_back(std::to_string(one_sided) + " pieces with one side only");
  tell(lines, not_faces, "lines, points or curves, which have no surface");
  tell(lines, unknown, "statements that an OBJ file does not have");
  return lines;
}

}  // namespace engine
