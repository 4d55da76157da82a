#include "engine/orbit/shadow.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr double kEarthFlattening = 1.0 / 298.257;  // WGS 84, rounded
constexpr double kSunRadius_m = 6.957e8;            // IAU 2015 B3, nominal

/// Distance to the region behind the Earth that rays along its rim bound, which open by a sine
/// from the axis: a cone, or a cylinder at 0. In the half-plane through body and axis the region
/// begins where the ray touches the Earth and lies below the ray.
double margin_behind_m(const Eigen::Vector3d& body, const Eigen::Vector3d& sun,
                       double sine) noexcept {
  const Eigen::Vector3d to_sun = sun.normalized();
  const double along = body.dot(to_sun);
  const double behind = -along;
  const double off_axis = (body - along * to_sun).norm();
  const double cosine = std::sqrt(1.0 - sine * sine);
  const double past_touch = behind * cosine + off_axis * sine;
  const double above_ray = off_axis * cosine - behind * sine - kEarthRadius_m;
  if (past_touch >= 0.0) return above_ray;
  return std::hypot(past_touch, std::max(0.0, above_ray));
}

/// Of the rays that touch Earth and Sun on the same side, and on opposite ones.
double umbra_sine(const Eigen::Vector3d& sun) noexcept {
  return (kEarthRadius_m - kSunRadius_m) / sun.norm();
}
double penumbra_sine(const Eigen::Vector3d& sun) noexcept {
  return (kEarthRadius_m + kSunRadius_m) / sun.norm();
}

/// What a chord at a distance from the middle of a circle of radius 1 cuts off.
double cut_off(double distance) noexcept {
  const double half_chord = std::sqrt(std::max(0.0, 1.0 - distance * distance));
  return std::atan2(half_chord, distance) - distance * half_chord;
}

/// Of the Sun's disc, in its radii: the limb passes `u` from its middle, on the Sun's side where
/// that is negative, and bends by 1 / `bend` radii.
double share_above_limb(double u, double bend) noexcept {
  // The common chord of the discs, and what of each lies beyond it.
  const double chord = (2.0 * u + bend * (u * u + 1.0)) / (2.0 * (1.0 + bend * u));
  const double d = std::clamp(chord, -1.0, 1.0);
  const double y = std::sqrt(1.0 - d * d);
  // The Earth's part to the fifth power of its angle.
  const double angle = bend * y;
  const double earths = 2.0 / 3.0 * y * y * angle * (1.0 + 0.3 * angle * angle);
  return std::clamp(1.0 - (cut_off(d) + earths) / kPi, 0.0, 1.0);
}

/// Pre: in the penumbra.
double share_of_discs(const Eigen::Vector3d& body, const Eigen::Vector3d& sun) noexcept {
  const Eigen::Vector3d to_sun = sun - body;
  const double r = body.norm();
  const double limb_distance = std::sqrt(std::max(0.0, r * r - kEarthRadius_m * kEarthRadius_m));
  const double earth_rad = std::atan2(kEarthRadius_m, limb_distance);
  const double sun_rad = std::asin(kSunRadius_m / to_sun.norm());
  const double u = (angle_between_rad(to_sun, -body) - earth_rad) / sun_rad;
  return share_above_limb(std::clamp(u, -1.0, 1.0), sun_rad * limb_distance / kEarthRadius_m);
}

}  // namespace

Position<J2000> earth_made_round(const Position<J2000>& place) noexcept {
  return {{place.m.x(), place.m.y(), place.m.z() / (1.0 - kEarthFlattening)}};
}

double shadow_margin_m(ShadowModel model, const Position<J2000>& body,
                       const Position<J2000>& sun) noexcept {
  switch (model) {
    case ShadowModel::kCylinder:
      return margin_behind_m(body.m, sun.m, 0.0);
    case ShadowModel::kCone:
      return margin_behind_m(body.m, sun.m, umbra_sine(sun.m));
    case ShadowModel::kOblateCone:
      break;
  }
  const Eigen::Vector3d round_sun = earth_made_round(sun).m;
  // Nothing is stretched by more than z.
  return (1.0 - kEarthFlattening) *
         margin_behind_m(earth_made_round(body).m, round_sun, umbra_sine(round_sun));
}

double lit_fraction(ShadowModel model, const Position<J2000>& body,
                    const Position<J2000>& sun) noexcept {
  if (!(shadow_margin_m(model, body, sun) > 0.0)) return 0.0;
  if (model == ShadowModel::kCylinder) return 1.0;
  const bool oblate = model == ShadowModel::kOblateCone;
  const Eigen::Vector3d b = oblate ? earth_made_round(body).m : body.m;
  const Eigen::Vector3d s = oblate ? earth_made_round(sun).m : sun.m;
  return margin_behind_m(b, s, penumbra_sine(s)) >= 0.0 ? 1.0 : share_of_discs(b, s);
}

}  // namespace engine
