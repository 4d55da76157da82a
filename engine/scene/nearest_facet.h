#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/mesh.h"

namespace engine {

/// The place of a mesh's surface that is nearest to a point, if it is within reach.
///
/// Triangles lie in the cells of a grid; a point asks the cells round its own. Of two sides of a
/// thin plate it is the one whose normal agrees.
/// Thread: any. Loop-safe but for the constructor. The mesh outlives it.
class NearestFacet {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Place {
    std::uint32_t triangle = kNone;
    float second = 0;  ///< weight of the second corner
    float third = 0;
    float distance_m = 0;
  };

  NearestFacet(const Mesh& mesh, double reach_m);

  /// False: triangles so large and so many that the grid has no room for them. Nothing is found.
  [[nodiscard]] bool fits() const noexcept { return !starts_.empty(); }
  /// On triangles of this material; those that face as `normal` does come first.
  [[nodiscard]] Place find(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                           std::uint32_t material) const noexcept;

 private:
  using Cell = Eigen::Vector3i;
  [[nodiscard]] Cell cell_of(const Eigen::Vector3f& point) const noexcept;
  [[nodiscard]] std::size_t index_of(const Cell& cell) const noexcept;
  template <class Visit>
  void each_cell_of(const Mesh::Triangle& triangle, const Visit& visit) const;
  [[nodiscard]] float squared_distance_to(const Cell& cell,
                                          const Eigen::Vector3f& point) const noexcept;

  const Mesh& mesh_;
  float reach_m_;
  float cell_m_ = 1;
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  Cell cells_ = Cell::Ones();
  std::vector<Eigen::Vector3f> normals_;  ///< by triangle
  std::vector<std::uint32_t> starts_;     ///< by cell, and the end of the last
  std::vector<std::uint32_t> triangles_;
};

}  // namespace engine
