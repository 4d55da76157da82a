#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/mesh.h"
#include "engine/scene/mesh_report.h"

namespace starloop {

/// A mesh seen in parallel from one side, for a picture of it.
struct MeshView {
  std::string title;  ///< "from +x"
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();  ///< along right and up
  double side_m = 0;                                ///< of the square that is seen

  /// Where an edge is in the view, and whether a face is before its middle.
  struct Line {
    std::array<Eigen::Vector2d, 2> end_m;
    bool open = true;
    bool hidden = false;
  };
  std::vector<Line> lines;
};

/// From +x, +y, +z and from two opposite corners of the box, in one scale, with the edges that are
/// no part of a closed surface. Writes the views side by side as a colour PNG of squares: a colour
/// for each material, by its index in kMaterialColours, brightest where a face looks at the viewer.
/// Throws std::runtime_error.
[[nodiscard]] std::vector<MeshView> draw_views(const engine::Mesh& mesh,
                                               const engine::MeshReport& report,
                                               const std::string& png);

/// Red, green, blue; after the last come the first again.
inline constexpr std::array<std::array<int, 3>, 7> kMaterialColours = {{{214, 214, 208},
                                                                        {230, 180, 80},
                                                                        {96, 142, 200},
                                                                        {120, 180, 140},
                                                                        {170, 130, 180},
                                                                        {130, 110, 90},
                                                                        {90, 160, 170}}};

}  // namespace starloop
