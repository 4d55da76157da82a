#include "engine/render/facet_nodes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kFacetsAShare = 256;
constexpr float kNodesACube = 1.5F;
// Weight of the nodes that are known, below which a place is on its own.
constexpr float kLeastKnown = 0.05F;
constexpr float kMostSteps = 256.0F;
// A mesh that has more, mad as it is, gets one node a facet from there on.
constexpr std::size_t kManyNodes = std::size_t{1} << 22U;

/// 0 where one node is enough.
std::uint16_t steps_along(const Vector3f& edge, float cube_m) noexcept {
  const float steps = std::ceil(edge.norm() / cube_m * kNodesACube - 0.5F);
  return static_cast<std::uint16_t>(std::clamp(steps, 0.0F, kMostSteps));
}

}  // namespace

FacetNodes::FacetNodes(const TracedTarget& target, const SurfacePatches& patches)
    : target_(target), side_seen_(target.mesh.triangles.size(), 0) {
  const float cube_m = patches.cube_m();
  const auto facets = static_cast<std::uint32_t>(target.mesh.triangles.size());
  grids_.reserve(2 * std::size_t{facets});
  for (std::uint32_t f = 0; f < facets; ++f) {
    const Vector3f corner = target.facets.on_side(f, 0, 0, 0).place;
    const Vector3f first = target.facets.on_side(f, 1, 0, 0).place - corner;
    const Vector3f second = target.facets.on_side(f, 0, 1, 0).place - corner;
    for (const unsigned side : {0U, 1U}) {
      Grid grid{static_cast<std::uint32_t>(nodes_.size()), steps_along(first, cube_m),
                steps_along(second, cube_m)};
      if ((grid.along_first == 0 && grid.along_second == 0) || nodes_.size() > kManyNodes) {
        grid.along_first = grid.along_second = 0;
        nodes_.push_back(patches.around(target.facets.on_side(f, 1.0F / 3.0F, 1.0F / 3.0F, side)));
        grids_.push_back(grid);
        continue;
      }
      grid.along_first = std::max<std::uint16_t>(grid.along_first, 1);
      grid.along_second = std::max<std::uint16_t>(grid.along_second, 1);
      for (int i = 0; i <= grid.along_first; ++i) {
        for (int k = 0; k <= grid.along_second; ++k) {
          const float a = static_cast<float>(i) / static_cast<float>(grid.along_first);
          const float b = static_cast<float>(k) / static_cast<float>(grid.along_second);
          // Beyond the third edge the nearest place on it.
          const float beyond = std::max(0.0F, 0.5F * (a + b - 1.0F));
          const float in_a = std::clamp(a - beyond, 0.0F, 1.0F);
          const float in_b = std::clamp(b - beyond, 0.0F, 1.0F);
          nodes_.push_back(patches.around(target.facets.on_side(f, in_a, in_b, side)));
        }
      }
      grids_.push_back(grid);
    }
  }
  values_.resize(nodes_.size());
}

void FacetNodes::update(std::span<const float> by_patch, const Vector3d& camera_m,
                        WorkerPool& pool) noexcept {
  const int facets = static_cast<int>(side_seen_.size());
  pool.rows(0, (facets + kFacetsAShare - 1) / kFacetsAShare, [&](int share) {
    const int end = std::min(facets, (share + 1) * kFacetsAShare);
    for (int i = share * kFacetsAShare; i < end; ++i) {
      const auto f = static_cast<std::uint32_t>(i);
      const SurfacePoint corner = target_.facets.on_side(f, 0, 0, 0);
      const Vector3d to_camera = camera_m - corner.place.cast<double>();
      const unsigned side = corner.normal.cast<double>().dot(to_camera) >= 0.0 ? 0 : 1;
      side_seen_[f] = static_cast<std::uint8_t>(side);
      const Grid& grid = grids_[2 * std::size_t{f} + side];
      const std::uint32_t end_node = grid.first + grid.nodes();
      for (std::uint32_t n = grid.first; n < end_node; ++n) {
        // Not a number where all is crowded.
        float sum = 0.0F;
        for (std::size_t k = 0; k < nodes_[n].patch.size(); ++k)
          sum += nodes_[n].weight[k] * by_patch[nodes_[n].patch[k]];
        values_[n] = nodes_[n].crowded ? std::numeric_limits<float>::quiet_NaN() : sum;
      }
    }
  });
}

float FacetNodes::at(std::uint32_t facet, float second, float third, float own) const noexcept {
  const Grid& grid = grids_[2 * std::size_t{facet} + side_seen_[facet]];
  if (grid.along_first == 0) {
    const float value = values_[grid.first];
    return std::isnan(value) ? own : value;
  }
  // Weights at a place that is no number are none either.
  const auto inside = [](float weight) { return weight > 0.0F ? std::min(weight, 1.0F) : 0.0F; };
  const float a = inside(second) * static_cast<float>(grid.along_first);
  const float b = inside(third) * static_cast<float>(grid.along_second);
  const auto i = std::min(static_cast<unsigned>(a), grid.along_first - 1U);
  const auto k = std::min(static_cast<unsigned>(b), grid.along_second - 1U);
  const float in_a = a - static_cast<float>(i);
  const float in_b = b - static_cast<float>(k);
  const float* low = &values_[grid.first + i * (grid.along_second + 1U) + k];
  const float* high = low + grid.along_second + 1U;
  const std::array<float, 4> value = {low[0], low[1], high[0], high[1]};
  const std::array<float, 4> weight = {(1.0F - in_a) * (1.0F - in_b), (1.0F - in_a) * in_b,
                                       in_a * (1.0F - in_b), in_a * in_b};
  float sum = 0.0F;
  float known = 0.0F;
  for (std::size_t n = 0; n < value.size(); ++n) {
    if (std::isnan(value[n])) continue;
    sum += weight[n] * value[n];
    known += weight[n];
  }
  return known > kLeastKnown ? sum / known : own;
}

}  // namespace engine
