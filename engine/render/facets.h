#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/render/embree_scene.h"
#include "engine/render/lamp_cone.h"
#include "engine/scene/brdf.h"
#include "engine/scene/mesh.h"

namespace engine {

/// A place on the surface.
struct SurfacePoint {
  Eigen::Vector3f place = Eigen::Vector3f::Zero();    ///< from the corners, not from the ray
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, on the side that is looked at
  std::uint32_t material = 0;
  float offset_m = 0;  ///< leave the surface by this much along the normal: bounds the rounding
  [[nodiscard]] Eigen::Vector3f start() const noexcept { return place + offset_m * normal; }
};

/// Rows are x, y and normal.
[[nodiscard]] Eigen::Matrix3d basis_round(const Eigen::Vector3d& normal) noexcept;

/// The triangles as shading sees them, and the direct light that each sends to the camera.
///
/// Lamps are parallel and the camera is far: over one facet the direct light is the same for every
/// ray, so it is worked out once a frame for each facet's middle instead of once a sample, when the
/// first ray asks: of a fine mesh most facets face away, or lie between rays. At 70 km a facet of
/// 4 m turns the view by 3e-5 rad, .5 % of the flank of the narrowest lobe.
///
/// Facets stand for a smooth surface: where a glint is near, a facet sends the mean over the
/// normals of the surface it replaces. Flat facets would flash one after the other, three times too
/// bright, and be dark between. Facets that meet at 40 deg or more are taken for an edge.
///
/// Where a glint is near and the lobe narrow, the Sun is its disc and not a point: at the top of a
/// lobe .4 deg wide that takes 12 %; half a degree off it takes 1.3 %, and is left out there.
///
/// Thread: light_up() the loop's, the rest any. Loop-safe but for the constructor.
class Facets {
 public:
  Facets(const Mesh& mesh, std::vector<Brdf> brdfs);

  /// Where the camera is and the lamps are from now on. Sun of radius 0: a point.
  void light_up(const BodyView& view, double sun_radius_rad = kSunAngularRadius_rad) noexcept;

  /// What facet `triangle` sends to the camera for each lamp, in W/m^2/sr, when nothing shades it.
  [[nodiscard]] std::array<float, kLamps> radiance(std::uint32_t triangle) const noexcept;
  /// The place of a hit; the normal on the side that `direction` comes from.
  [[nodiscard]] SurfacePoint at(const MeshHit& hit,
                                const Eigen::Vector3f& direction) const noexcept;
  /// Where the line from `start` along `direction` meets the plane of facet `triangle`.
  [[nodiscard]] SurfacePoint on_plane(std::uint32_t triangle, const Eigen::Vector3f& start,
                                      const Eigen::Vector3f& direction) const noexcept;
  /// A place on side 0, which the normal leaves, or 1.
  [[nodiscard]] SurfacePoint on_side(std::uint32_t triangle, float second, float third,
                                     unsigned side) const noexcept {
    const Facet& f = facets_[triangle];
    return {f.corner + second * f.edge1 + third * f.edge2,
            side == 0 ? f.normal : Eigen::Vector3f(-f.normal), f.material, f.offset_m};
  }
  /// Of the second and third corner, for a place on the plane of facet `triangle`.
  [[nodiscard]] std::array<float, 2> weights_at(std::uint32_t triangle,
                                                const Eigen::Vector3f& place) const noexcept;
  [[nodiscard]] double area_m2(std::uint32_t triangle) const noexcept {
    const Facet& f = facets_[triangle];
    return 0.5 * f.edge1.cast<double>().cross(f.edge2.cast<double>()).norm();
  }
  [[nodiscard]] const Brdf& brdf(std::uint32_t material) const noexcept { return brdfs_[material]; }

 private:
  struct Facet {
    Eigen::Vector3f corner;
    Eigen::Vector3f edge1;
    Eigen::Vector3f edge2;
    Eigen::Vector3f normal;
    float offset_m = 0;
    std::uint32_t material = 0;
    CornerNormals normals;  ///< of the smooth surface
    float spread_rad = 0;   ///< of these, from the facet's own

    [[nodiscard]] SurfacePoint seen_along(const Eigen::Vector3f& direction,
                                          const Eigen::Vector3f& place) const noexcept;
  };
  [[nodiscard]] double reflected(const Facet& facet, double side, const LampCone& lamp,
                                 const Eigen::Vector3d& to_camera) const noexcept;
  [[nodiscard]] std::array<float, kLamps> light_of(const Facet& facet) const noexcept;

  /// What is known of a facet's light. Threads that ask at once all find the same.
  struct Known {
    std::array<float, kLamps> radiance{};
    std::uint64_t view = 0;  ///< that it was worked out for
  };
  std::vector<Facet> facets_;
  std::vector<Brdf> brdfs_;  ///< by the mesh's material index
  mutable std::vector<Known> known_;
  std::uint64_t view_ = 1;  ///< counts up
  Eigen::Vector3d camera_ = Eigen::Vector3d::UnitZ();
  LampCones lamps_;
};

}  // namespace engine
