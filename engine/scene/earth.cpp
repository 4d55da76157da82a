#include "engine/scene/earth.h"

#include <cmath>
#include <limits>

#include "engine/core/constants.h"

namespace engine {

std::string_view name_of(EarthshineModel model) noexcept {
  constexpr std::array<std::string_view, 6> kNames{"none",      "paper-lamp", "vector",
                                                   "harmonics", "cap",        "auto"};
  return kNames[static_cast<std::size_t>(model)];
}

std::string_view name_of(AlbedoModel model) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"even", "zonal", "map"};
  return kNames[static_cast<std::size_t>(model)];
}

EarthSpec read_earth(const ConfigTable& table) {
  EarthSpec spec;
  spec.earthshine = table.choice_or<EarthshineModel>("earthshine", "auto",
                                                     {{"none", EarthshineModel::kNone},
                                                      {"paper-lamp", EarthshineModel::kPaperLamp},
                                                      {"vector", EarthshineModel::kVector},
                                                      {"harmonics", EarthshineModel::kHarmonics},
                                                      {"cap", EarthshineModel::kCap},
                                                      {"auto", EarthshineModel::kAuto}});
  if (table.is_text("albedo")) {
    spec.albedo_model = table.choice_or<AlbedoModel>(
        "albedo", "map", {{"zonal", AlbedoModel::kZonal}, {"map", AlbedoModel::kMap}});
  } else {
    spec.albedo = table.number_or("albedo", 0.3, between(0.0, 1.0));
  }
  spec.in_frame = table.choice_or<bool>("in_frame", "auto", {{"auto", true}, {"no", false}});
  spec.air.optical_depth =
      table.number_or("air_optical_depth", spec.air.optical_depth, between(0.0, 10.0));
  return spec;
}

ZonalAlbedo zonal_albedo(Epoch t) noexcept {
  constexpr double kDecember22Of1981_d = -6584.5;  // from 2000-01-01T12
  constexpr double kYear_d = 365.25;
  const double days = seconds(t.time_since_epoch()) / 86400.0 - kDecember22Of1981_d;
  return {{0.34, 0.10 * std::cos(2.0 * kPi * days / kYear_d), 0.29}};
}

EarthshineChoice choose_earthshine(EarthshineModel wanted, const EarthLight& light,
                                   const EarthshineSensor& sensor) noexcept {
  // In a pixel: of what a diffuse surface receives, and of what a mirror shows.
  const auto diffuse_e = [&](double scalar_w_m2) {
    return sensor.e_per_radiance * sensor.diffuse_albedo *
           std::min(scalar_w_m2 / kPi, light.largest_radiance_w_m2_sr());
  };
  const double glossy_e =
      sensor.e_per_radiance * sensor.glossy_albedo * light.largest_radiance_w_m2_sr();
  const double all_e = diffuse_e(light.scalar_irradiance_w_m2()) + glossy_e;
  const double harmonics_e = sensor.e_per_radiance * sensor.diffuse_albedo / kPi *
                                 EarthLight::kHarmonicsError * light.scalar_irradiance_w_m2() +
                             glossy_e;
  const bool known = sensor.e_per_radiance > 0.0;
  const double unseen_e =
      known ? sensor.unseen_sigmas * std::sqrt(sensor.dark_variance_e2 + all_e) : 0.0;
  EarthshineChoice choice;
  if (light.disc().albedo_by_place) choice.albedo = AlbedoModel::kMap;
  const bool automatic = wanted == EarthshineModel::kAuto;
  if (automatic) {
    wanted = EarthshineModel::kCap;
    if (known && harmonics_e <= unseen_e) wanted = EarthshineModel::kHarmonics;
    if (light.dark() || (known && all_e <= unseen_e)) wanted = EarthshineModel::kNone;
  }
  choice.model = wanted;
  const bool exact =
      wanted == EarthshineModel::kCap || (light.dark() && wanted != EarthshineModel::kPaperLamp);
  if (!exact) {
    choice.error_e = wanted == EarthshineModel::kHarmonics ? harmonics_e : all_e;
    if (!known || wanted == EarthshineModel::kPaperLamp)
      choice.error_e = std::numeric_limits<double>::quiet_NaN();
  }
  const double map_e = diffuse_e(light.moved_by_map_w_m2()) + glossy_e;
  if (automatic && known && choice.albedo == AlbedoModel::kMap &&
      choice.error_e + map_e <= unseen_e) {
    choice.albedo = AlbedoModel::kZonal;
    choice.albedo_error_e = map_e;
  }
  return choice;
}

Eigen::Vector3d paper_earth_lamp(const Position<J2000>& target, double albedo,
                                 double sun_irradiance) noexcept {
  return -albedo * sun_irradiance * target.m.normalized();
}

}  // namespace engine
