#include "engine/orbit/visibility.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {

std::string_view name_of(Condition condition) noexcept {
  constexpr std::array<std::string_view, kConditions + 1> kNames{
      "range", "line-of-sight", "eclipse",      "sun-exclusion",
      "field", "signal",        "earth-behind", "span"};
  return kNames[static_cast<std::size_t>(condition)];
}

VisibilitySpec read_visibility(const ConfigTable& table, SunModel sun,
                               double half_diagonal_field_rad) {
  VisibilitySpec spec;
  spec.max_range_m = table.number_or("max_range_km", 300.0, positive()) * 1e3;
  spec.line_of_sight_height_m =
      table.number_or("line_of_sight_height_km", 0.0, between(0.0, 1000.0)) * 1e3;
  const double margin_rad = table.number_or("sun_margin_deg", 0.0, from_below(0.0, 90.0)) * kDegree;
  spec.sun_exclusion_rad = kSunAngularRadius_rad + half_diagonal_field_rad + margin_rad;
  spec.sun = sun;
  spec.shadow = table.choice_or<ShadowModel>("shadow", "oblate-cone",
                                             {{"cylinder", ShadowModel::kCylinder},
                                              {"cone", ShadowModel::kCone},
                                              {"oblate-cone", ShadowModel::kOblateCone}});
  SignalLimit signal;
  signal.least_snr = table.number_or("least_snr", 0.0, between(0.0, 1e6));
  signal.albedo = table.number_or("target_albedo", signal.albedo, between(0.001, 1.0));
  if (signal.least_snr > 0.0) {
    signal.radius_m = table.number("target_radius_m", between(1e-3, 1e4));
    spec.signal = signal;
  } else if (table.has("target_radius_m")) {
    table.fail("target_radius_m", "is of no use without least_snr");
  }
  return spec;
}

double line_of_sight_margin_m(const Position<J2000>& camera, const Position<J2000>& target,
                              double height_m) noexcept {
  const Eigen::Vector3d line = target.m - camera.m;
  const double length2 = line.squaredNorm();
  // The place on the segment closest to the Earth's centre; its ends where the foot lies outside.
  const double along = length2 > 0.0 ? std::clamp(-camera.m.dot(line) / length2, 0.0, 1.0) : 0.0;
  return (camera.m + along * line).norm() - (kEarthRadius_m + height_m);
}

bool earth_is_behind(const Position<J2000>& camera, const Position<J2000>& target) noexcept {
  const Eigen::Vector3d line = (target.m - camera.m).normalized();
  const double along = -camera.m.dot(line);
  return along > 0.0 && (camera.m + along * line).norm() < kEarthRadius_m;
}

}  // namespace engine
