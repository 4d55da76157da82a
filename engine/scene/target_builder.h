#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "engine/scene/grouped_mesh.h"

namespace engine {

/// Adds solids to a target, each placed by a pose. All lengths in metres; each solid's vertices are
/// its own, and outside is outside.
class TargetBuilder {
 public:
  /// What is added from here on is of this material and belongs to this group.
  void choose(const std::string& material, const std::string& group);
  [[nodiscard]] std::size_t triangles() const noexcept { return target_.mesh.triangles.size(); }
  [[nodiscard]] GroupedMesh target() && { return std::move(target_); }

  /// A corner of an outline that is turned about x.
  struct Ring {
    double x_m = 0;
    double radius_m = 0;  ///< >= 0
  };
  /// How far an outline is turned, from +y towards +z, in steps of a whole turn over `segments`.
  struct Sweep {
    int segments = 72;
    /// Only so many facets, about this angle; all when it is not there.
    struct Part {
      double middle_rad = 0;
      int facets = 1;
    };
    std::optional<Part> part;
  };

  /// Centred on the pose's origin.
  void box(const Eigen::Isometry3d& pose, const Eigen::Vector3d& size_m);
  /// Walked to +x with the radius upwards, the solid is on the right. Closed when the outline ends
  /// on the axis, or where it began.
  void revolve(const Eigen::Isometry3d& pose, const std::vector<Ring>& outline, const Sweep& sweep);
  /// A band about x between two places and two radii; a part of one has its two ends closed.
  void band(const Eigen::Isometry3d& pose, const Ring& low, const Ring& high, const Sweep& sweep);
  /// Between two places.
  void rod(const Eigen::Isometry3d& pose, const Eigen::Vector3d& from_m,
           const Eigen::Vector3d& to_m, double radius_m, int segments);
  /// Vertices and triangles made elsewhere.
  void add(const Eigen::Isometry3d& pose, const Mesh& mesh);

 private:
  std::uint32_t vertex(const Eigen::Vector3d& p_m);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }

  GroupedMesh target_;
  std::uint32_t material_ = 0;
  std::uint32_t group_ = 0;
};

}  // namespace engine
