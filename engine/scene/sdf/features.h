#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/sdf/solid.h"
#include "engine/scene/sdf/surface_truss.h"
#include "engine/scene/sdf/work_mesh.h"

namespace engine {

/// What is sharp about a shape: corners, the creases between them, and the smooth sheets that the
/// creases bound. An advancing front starts from these.
struct FeatureGraph {
  /// A sheet beside a crease. Walking along the crease with the sheet's normal upwards, the sheet
  /// is on the left, or the other way round.
  struct Side {
    std::uint32_t sheet = 0;
    bool on_left = true;
  };
  struct Crease {
    std::vector<Eigen::Vector3d> path_m;    ///< close together; straight lines have their ends only
    bool closed = false;                    ///< the last place leads to the first
    std::array<std::uint32_t, 2> corner{};  ///< where it ends; of no meaning when closed
    std::vector<Side> sides;                ///< two of a body, one of a plane region
    std::vector<std::size_t> faces;         ///< two of a solid: it lies on both
  };
  struct Tip {
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    std::uint32_t sheet = 0;
  };
  std::vector<Eigen::Vector3d> corners_m;
  std::vector<Crease> creases;
  std::vector<Tip> tips;
  std::vector<Sheet> sheets;            ///< normals outwards
  std::vector<std::uint32_t> seamless;  ///< sheets that no crease bounds: closed by themselves
  std::string missing;                  ///< why it is not complete; empty when it is
};

/// Every crease of a solid, by marching along the places where two faces are zero, by Newton's
/// method, from seeds in an octree; a crease is where of the four sectors between two faces one, or
/// three, are inside. Corners are where a third face comes in: exact to rounding. Faces in one
/// surface (of boxes that stand flush) count as one. Not complete where two faces touch without
/// crossing. `size_m` is about the mesh's. The solid outlives the graph.
[[nodiscard]] FeatureGraph features_of(const Solid& solid, double size_m);
/// Of a region of the plane z = 0 between closed polygons, outer ones anticlockwise, holes
/// clockwise.
[[nodiscard]] FeatureGraph features_of(const std::vector<std::vector<Eigen::Vector3d>>& loops_m);

/// A crease as vertices, from its first corner to its last, so that its edges are as long as the
/// size function wants and turn by at most 45 degrees. The ends are exactly the corners.
[[nodiscard]] std::vector<Eigen::Vector3d> divided(const FeatureGraph& graph,
                                                   const FeatureGraph::Crease& crease,
                                                   const Solid* solid, const SizeFunction& size_m);

}  // namespace engine
