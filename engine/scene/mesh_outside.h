#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/box_tree.h"
#include "engine/scene/mesh.h"
#include "engine/scene/mesh_topology.h"

namespace engine {

/// Which side of an open piece of a mesh looks outwards: the one that more rays leave from without
/// meeting any of the mesh.
///
/// Source: Takayama et al. 2014, A Simple Method for Correcting Facet Orientations in Polygon
/// Meshes Based on Ray Casting, Journal of Computer Graphics Techniques 3(4), 53-63. We differ:
/// rays start in pairs, one from each side of a place, mirrored in it, so that only pairs of which
/// just one leaves count; kEither where their difference may be chance (under 3 sigma) and for want
/// of occluders, as on a plate. Leaves out: how far off a ray meets the mesh, which tells sides of
/// a piece that nothing leaves from (within a closed hull): kEither. Thread: one. Same answers for
/// the same mesh and the same questions.
class MeshOutside {
 public:
  explicit MeshOutside(const Mesh& mesh);

  enum class Side : std::uint8_t { kFirst, kOther, kEither, kGaveUp };
  /// Against the side that the piece's first triangle shows. All answers together take some second
  /// at most: after that, kGaveUp.
  [[nodiscard]] Side of(const MeshTopology::Piece& piece);

 private:
  struct Ray {
    Eigen::Vector3d from;
    Eigen::Vector3d along;
    std::uint32_t triangle = 0;  ///< that it starts on
  };
  [[nodiscard]] BoxTree::Found is_met(const Ray& ray, double nearest_m);

  const Mesh& mesh_;
  BoxTree tree_;
  std::uint64_t steps_;
};

}  // namespace engine
