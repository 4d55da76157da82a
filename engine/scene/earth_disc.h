#pragma once

#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/vec.h"
#include "engine/scene/earth_map.h"

namespace engine {

/// The Earth as an observer sees it: a Lambert sphere under a distant Sun, without air, its
/// terminator sharp.
/// Leaves out flattening, and that clouds and seas send more light forward than back: towards the
/// limb a real Earth under a low Sun is brighter than this one.
template <class Frame>
struct EarthDisc {
  Direction<Frame> to_centre;
  Direction<Frame> to_sun;
  Direction<Frame> north;
  double distance_radii = 0;  ///< of the observer from the centre; 1 or less: no Earth to be seen
  double sun_irradiance_w_m2 = 0;
  ZonalAlbedo albedo;
  bool albedo_by_place = false;  ///< shared out among sea, land, desert and ice
  Direction<Frame> greenwich{Eigen::Vector3d::UnitX()};  ///< on the equator; only for that

  [[nodiscard]] bool seen() const noexcept { return distance_radii > 1.0; }
  /// How far, in radii, the line along the unit vector `direction` passes from the centre; more
  /// than any number where it leads away from the Earth.
  [[nodiscard]] double passes_at_radii(const Eigen::Vector3d& direction) const noexcept {
    if (!(direction.dot(to_centre.unit) > 0.0)) return HUGE_VAL;
    return distance_radii * direction.cross(to_centre.unit).norm();
  }
  /// The vertical where that line meets the ground, or comes closest to it.
  [[nodiscard]] Eigen::Vector3d vertical_at(const Eigen::Vector3d& direction,
                                            double passes_at_radii) const noexcept {
    const double p = passes_at_radii;
    const double to_foot = distance_radii * direction.dot(to_centre.unit);
    const double slant = p < 1.0 ? to_foot - std::sqrt(1.0 - p * p) : to_foot;
    const Eigen::Vector3d place = slant * direction - distance_radii * to_centre.unit;
    return p < 1.0 ? place : Eigen::Vector3d(place / p);
  }
  [[nodiscard]] double albedo_at(const Eigen::Vector3d& vertical) const noexcept {
    const double sin_latitude = vertical.dot(north.unit);
    if (!albedo_by_place) return albedo.at(sin_latitude);
    const Eigen::Vector3d east = north.unit.cross(greenwich.unit);
    return place_albedo(albedo, {vertical.dot(greenwich.unit), vertical.dot(east), sin_latitude});
  }
  /// On the whole Earth.
  [[nodiscard]] double largest_albedo() const noexcept {
    return albedo_by_place ? largest_place_albedo(albedo) : albedo.largest();
  }
  /// Of ground that the Sun shines on from the zenith.
  [[nodiscard]] double zenith_radiance_w_m2_sr(const Eigen::Vector3d& vertical) const noexcept {
    return sun_irradiance_w_m2 / kPi * albedo_at(vertical);
  }
  /// 0 beyond the limb and on the night side. Pre: `direction` is a unit vector.
  [[nodiscard]] double radiance_w_m2_sr(const Eigen::Vector3d& direction) const noexcept {
    const double p = passes_at_radii(direction);
    if (!seen() || !(p < 1.0)) return 0.0;
    const Eigen::Vector3d vertical = vertical_at(direction, p);
    const double cos_sun = vertical.dot(to_sun.unit);
    return cos_sun > 0.0 ? cos_sun * zenith_radiance_w_m2_sr(vertical) : 0.0;
  }
};

}  // namespace engine
