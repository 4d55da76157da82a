#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/surface_patches.h"
#include "engine/render/traced_target.h"

namespace engine {

/// Figures kept by patch, made smooth over the facets: a mean of the patches around each node of a
/// grid on a facet, and linear between nodes. A facet smaller than a patch is one node. Crowded
/// patches lend nothing to those beside them: the brightness of a corner ends where the corner
/// does.
/// Thread: update() the loop's, at() any. Loop-safe but for the constructor.
class FacetNodes {
 public:
  FacetNodes(const TracedTarget& target, const SurfacePatches& patches);

  /// For the sides that face the camera.
  void update(std::span<const float> by_patch, const Eigen::Vector3d& camera_m,
              WorkerPool& pool) noexcept;

  /// `second` and `third` are the place's weights of the facet's corners, in [0, 1]. `own` is for
  /// where all is crowded: the place's own patch's figure.
  [[nodiscard]] float at(std::uint32_t facet, float second, float third, float own) const noexcept;

 private:
  using Node = SurfacePatches::Around;
  /// Of a side of a facet: steps of its nodes along its first edge and its second; 0 for one node.
  struct Grid {
    std::uint32_t first = 0;
    std::uint16_t along_first = 0;
    std::uint16_t along_second = 0;
    [[nodiscard]] std::uint32_t nodes() const noexcept {
      return (along_first + 1U) * (along_second + 1U);
    }
  };

  const TracedTarget& target_;
  std::vector<Grid> grids_;  ///< by 2 * facet + side
  std::vector<Node> nodes_;
  std::vector<float> values_;            ///< by node
  std::vector<std::uint8_t> side_seen_;  ///< by facet
};

}  // namespace engine
