#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/hemisphere_bins.h"
#include "engine/render/traced_target.h"

namespace engine {

/// The surface of a target in patches, and what each of them sees of the others: fixed to the body,
/// so found once, by rays.
///
/// A patch is what lies in one cube of a grid, faces about the same way and is of one material,
/// however the mesh is cut: large facets have many, many small facets share one. Sides that no
/// light can come to, insides of closed parts, have none.
/// Thread: any, once built. Loop-safe but for the constructor.
class SurfacePatches {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;  ///< no patch: nothing is known, so dark
  static constexpr std::uint32_t kSky = 0xFFFFFFFEU;   ///< a ray that leaves the target
  static constexpr std::size_t kPoints = 8;            ///< of a patch, that stand for it
  static constexpr std::size_t kRaysABin = 2;
  static constexpr std::size_t kRays = HemisphereBins::kBins * kRaysABin;

  struct Patch {
    Eigen::Vector3f place = Eigen::Vector3f::Zero();     ///< mean
    Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();   ///< mean, unit
    Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();  ///< rows: x, y, normal
    std::uint32_t material = 0;
    std::array<SurfacePoint, kPoints> points{};
  };

  /// `cubes_a_radius`: of the target's bounding sphere. Pre: in [1, 256].
  SurfacePatches(const TracedTarget& target, double cubes_a_radius, WorkerPool& pool);

  [[nodiscard]] std::size_t size() const noexcept { return patches_.size(); }
  [[nodiscard]] const Patch& patch(std::size_t p) const noexcept { return patches_[p]; }
  /// The patch of a place; kNone when none is near that faces the same way.
  [[nodiscard]] std::uint32_t at(const SurfacePoint& place) const noexcept;

  [[nodiscard]] float cube_m() const noexcept { return 1.0F / grid_.per_m; }

  /// By ray, kRaysABin to a bin: the patch that it meets, kNone or kSky.
  [[nodiscard]] std::span<const std::uint32_t> seen_from(std::size_t p) const noexcept {
    return std::span(links_).subspan(p * kRays, kRays);
  }

 private:
  struct Grid {
    Eigen::Vector3f low = Eigen::Vector3f::Zero();
    float per_m = 1;
    std::size_t side = 1;  // cubes
    [[nodiscard]] std::size_t cube_of(const Eigen::Vector3f& place) const noexcept;
    [[nodiscard]] std::size_t size() const noexcept { return side * side * side; }
  };

  void find(const TracedTarget& target);
  void trace(const TracedTarget& target, WorkerPool& pool);

  Grid grid_;
  std::vector<std::uint32_t> first_in_cube_;  ///< by cube, and one more
  std::vector<Patch> patches_;                ///< cube by cube
  std::vector<std::uint32_t> links_;
};

}  // namespace engine
