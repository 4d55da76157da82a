#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/vec.h"

namespace engine {

/// The ladder of earthshine, from cheap to exact.
enum class EarthshineModel : std::uint8_t {
  kNone,
  kPaperLamp,  ///< a lamp of .3 E0 from the nadir, whatever the Sun does: 1.1 to 48 times too much
  kVector,     ///< one lamp with the vector irradiance of the sunlit cap
};

struct EarthSpec {
  EarthshineModel earthshine = EarthshineModel::kVector;
  double albedo = 0.3;  ///< in [0, 1], Lambert
};
[[nodiscard]] EarthSpec read_earth(const ConfigTable& table);

/// The vector irradiance of the visible, sunlit part of the Earth at `target`: it points to where
/// the light comes from, and its length is what a facet that faces it receives, in the unit of
/// `sun_irradiance`.
///
/// The Earth is a Lambert sphere without air, its terminator sharp. Exact for every facet that sees
/// the whole visible cap; 72 x 96 points leave 0.2 % at 420 km.
/// Source: integral of L w dw over the cap, as Montenbruck & Gill 2000, section 3.4, does for
/// forces.
[[nodiscard]] Eigen::Vector3d earthshine_vector(const Position<J2000>& target,
                                                const Direction<J2000>& to_sun, double albedo,
                                                double sun_irradiance) noexcept;

/// Eq 12's earth lamp: .3 of 634.64 W/m^2 in the paper, from the nadir.
[[nodiscard]] Eigen::Vector3d paper_earth_lamp(const Position<J2000>& target, double albedo,
                                               double sun_irradiance) noexcept;

}  // namespace engine
