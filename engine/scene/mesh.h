#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace engine {

/// Triangles of a target, in metres, in its body frame. Seen from outside a triangle runs
/// anticlockwise, but shading is two-sided: open shells and flipped faces look right.
struct Mesh {
  struct Triangle {
    std::array<std::uint32_t, 3> corner{};
    std::uint32_t material = 0;  ///< index into material_names
  };
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::string> material_names;

  /// The index of a material; a name that is not there yet is added.
  [[nodiscard]] std::uint32_t material(const std::string& name);
  /// Of the smallest sphere round the origin that holds every vertex, in metres.
  [[nodiscard]] double bounding_radius_m() const noexcept;
};

/// The normals of the smooth surface that a triangle stands for, one at each corner, unit.
using CornerNormals = std::array<Eigen::Vector3f, 3>;

/// For each triangle. Faces that meet at less than `crease_rad` belong to one smooth surface: its
/// normal at a corner is their mean, each weighted by its angle there.
[[nodiscard]] std::vector<CornerNormals> smooth_normals(const Mesh& mesh, double crease_rad);

}  // namespace engine
