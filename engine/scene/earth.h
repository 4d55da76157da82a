#pragma once

#include <string_view>

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "engine/core/vec.h"
#include "engine/scene/earth_light.h"

namespace engine {

/// The ladder of earthshine, from cheap to exact.
enum class EarthshineModel : std::uint8_t {
  kNone,
  kPaperLamp,  ///< a lamp of .3 E0 from the nadir, whatever the Sun does: 1.1 to 48 times too much
  kVector,     ///< one lamp with the vector irradiance of the sunlit cap
  kHarmonics,  ///< EarthLight::irradiance_w_m2, for surfaces taken as diffuse
  kCap,        ///< EarthLight sampled: the sunlit cap as an area light
  kAuto        ///< the first of none, harmonics and cap whose error the sensor cannot see
};
[[nodiscard]] std::string_view name_of(EarthshineModel model) noexcept;

/// The ladder of the Earth's albedo.
enum class AlbedoModel : std::uint8_t {
  kEven,   ///< one number
  kZonal,  ///< zonal_albedo: by latitude and season
  kMap     ///< place_albedo: sea, land, desert and ice in each zone
};
[[nodiscard]] std::string_view name_of(AlbedoModel model) noexcept;

/// The air above the ground, as the limb shows it.
struct Air {
  /// Vertical, of air without dust. Bodhaine et al. 1999, DOI
  /// 10.1175/1520-0426(1999)016<1854:ORODC>2.0.CO;2: .221 at 450 nm, .017 at 850; this is the mean
  /// over sunlight in band.
  double optical_depth = 0.077;
  double scale_height_m = 8000;
};

struct EarthSpec {
  EarthshineModel earthshine = EarthshineModel::kVector;
  AlbedoModel albedo_model = AlbedoModel::kEven;
  double albedo = 0.3;   ///< kEven's, in [0, 1], Lambert
  bool in_frame = true;  ///< drawn where the camera sees it
  Air air;
};
[[nodiscard]] EarthSpec read_earth(const ConfigTable& table);

/// Albedo by latitude and season: .34 + .10 cos(2 pi (t - t0) / 365.25 d) P1 + .29 P2, t0 1981
/// December 22; .2 at the equator, .53 to .73 at the poles, .34 on average.
/// Source: Knocke, Ries & Tapley 1988, Earth radiation pressure effects on satellites, AIAA
/// 88-4292, from the Earth radiation budget of Stephens et al. 1981; ECSS-E-ST-10-04C, annex F,
/// recommends it. In sunlight .31 on average. Leaves out land and sea, which place_albedo adds, and
/// the clouds of the day: .05 to .6 from place to place.
[[nodiscard]] ZonalAlbedo zonal_albedo(Epoch t) noexcept;

/// The sensor and the surfaces that earthshine is judged by.
struct EarthshineSensor {
  double e_per_radiance = 0;    ///< electrons in a pixel for 1 W/m^2/sr; 0: not known
  double dark_variance_e2 = 0;  ///< of a pixel that no light falls on
  double diffuse_albedo = 1;    ///< the largest of any surface, in [0, 1]
  double glossy_albedo = 1;     ///< the same, of what is not diffuse
  double unseen_sigmas = 0.3;   ///< the sensor does not see an error of so many
};

struct EarthshineChoice {
  EarthshineModel model = EarthshineModel::kCap;
  double error_e = 0;  ///< the most that it is wrong by in a pixel, for a given EarthLight
  AlbedoModel albedo = AlbedoModel::kEven;  ///< in the same words: of earthshine, not of the frame
  double albedo_error_e = 0;                ///< of that, where the map is left out
};

/// The rung for `wanted` = kAuto, or `wanted` itself, and its bound.
///
/// A diffuse surface sends albedo/pi of what it receives, at most the scalar irradiance; any other
/// at most its albedo of the brightest radiance. Harmonics are wrong by 3/32 of the former and know
/// nothing of the latter. Sigma is that of a pixel that earthshine alone falls on: in sunlight
/// there is more noise.
/// A map of the albedo is left out where what it changes, by the same two terms, and the rung's own
/// error together are no more than the sensor sees; only with kAuto.
/// For the vector's lamp the bound is all its light: a facet that sees half of the cap may get
/// none. The paper's lamp has none: not a number.
[[nodiscard]] EarthshineChoice choose_earthshine(EarthshineModel wanted, const EarthLight& light,
                                                 const EarthshineSensor& sensor) noexcept;

/// Eq 12's earth lamp: .3 of 634.64 W/m^2 in the paper, from the nadir.
[[nodiscard]] Eigen::Vector3d paper_earth_lamp(const Position<J2000>& target, double albedo,
                                               double sun_irradiance) noexcept;

}  // namespace engine
