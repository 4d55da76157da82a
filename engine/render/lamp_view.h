#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/triangle_raster.h"
#include "engine/scene/mesh.h"

namespace engine {

enum class Lit : std::uint8_t { kUnknown, kYes, kNo };

/// What a parallel lamp sees of the target: which places of facets it reaches. Only at edges of
/// shadows has a ray to be asked.
///
/// A map of the surfaces nearest to the lamp, on a lattice of 1024 steps. Places are in the light
/// where nothing round them stands above their facet's plane, in the dark where everything does, by
/// some steps: the walls of a hollow stand above the plane of its floor and leave it lit.
/// A shadow or a gap narrower than a step, .2 % of the target's radius, is missed where no other
/// edge is near. Directions are rounded to 1 mrad, which moves a shadow by 5 mm over 10 m; what is
/// kept is a function of the rounded direction alone.
/// Thread: update() the loop's, the rest any. Loop-safe but for the constructor. The mesh outlives
/// it.
class LampView {
 public:
  explicit LampView(const Mesh& mesh);

  void update(const Eigen::Vector3d& toward, WorkerPool& pool) noexcept;

  /// Where a place falls on the map, in steps; a linear function of the place.
  [[nodiscard]] Eigen::Vector2f on_map(const Eigen::Vector3f& place) const noexcept {
    return to_map_ * place + Eigen::Vector2f::Constant(0.5F * kSide);
  }
  /// Of the facet's places in a rectangle of the map. Unknown for one of many steps.
  [[nodiscard]] Lit places(std::uint32_t facet, const Eigen::Vector2f& low,
                           const Eigen::Vector2f& high) const noexcept;
  /// The share of such a rectangle that the lamp reaches, by the map's steps in it alone: sooner
  /// known than by rays, and as right as the map is fine. No number where that cannot be told.
  [[nodiscard]] float lit_share(std::uint32_t facet, const Eigen::Vector2f& low,
                                const Eigen::Vector2f& high) const noexcept;

 private:
  static constexpr unsigned kSide = 1024;
  /// Nearness to the lamp over the map.
  struct Plane {
    float at_zero = 0;
    float per_x = 0;
    float per_y = 0;
  };

  /// Steps of the map round a rectangle, and of these those that stand above a facet's plane: at
  /// all, and by so much that they cast a shadow.
  struct Steps {
    int asked = 0;  ///< 0: it cannot be told
    int above = 0;
    int shading = 0;
  };
  /// Of rows of which some stand above and not all cast a shadow no more are counted if
  /// `mixed_ends`.
  [[nodiscard]] Steps count(std::uint32_t facet, const Eigen::Vector2f& low,
                            const Eigen::Vector2f& high, int beyond,
                            bool mixed_ends) const noexcept;
  void draw(int band) noexcept;
  [[nodiscard]] Plane plane_of(std::uint32_t facet, const Eigen::Matrix3d& axes) const noexcept;

  const Mesh& mesh_;
  double radius_m_;
  Eigen::Vector3d toward_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<float, 2, 3> to_map_ = Eigen::Matrix<float, 2, 3>::Zero();
  TriangleRaster raster_;
  std::vector<TriangleRaster::Corner> corners_;
  std::vector<std::uint32_t> facets_;  ///< over the map
  std::vector<float> nearness_;        ///< of these
  std::vector<Plane> planes_;          ///< by facet
};

}  // namespace engine
