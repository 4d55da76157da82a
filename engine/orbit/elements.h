#pragma once

#include <optional>

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/orbit/propagator.h"

namespace engine {

/// A conic about the Earth, osculating at the epoch. Angles in radians, J2000.
/// Where an angle has no meaning - the perigee of a circle, the node of an equatorial orbit - any
/// will do: its sum with the next one counts.
struct KeplerElements {
  double semi_major_axis_m = 7e6;  ///< negative for a hyperbola
  double eccentricity = 0;         ///< >= 0 and not 1; > 1 for a hyperbola
  double inclination_rad = 0;
  double argument_of_perigee_rad = 0;
  double raan_rad = 0;
  double mean_anomaly_rad = 0;  ///< at the epoch

  [[nodiscard]] double perigee_m() const noexcept {
    return semi_major_axis_m * (1.0 - eccentricity);
  }
};

/// A conic this close to the parabola has no elements: its semi-major axis is so long that the
/// rounding of the eccentricity moves the body by .1 m.
inline constexpr double kParabola = 1e-8;
/// Motion with less angular momentum than this share of |r| |v| is straight: it has no plane.
inline constexpr double kStraight = 1e-9;

/// The elements of a state: Vallado 2013, Fundamentals of Astrodynamics, algorithm 9, but with
/// arctangents for arccosines, and the true anomaly from the eccentric one, so that the sums hold
/// where the angles alone mean nothing. Back in a propagator they give the state, within 1e-6 m and
/// 1e-9 m/s, or nine roundings of a longer axis: 1e-9 m / |1 - e| near the parabola.
/// Nothing within kParabola and kStraight, and for a body at the Earth's centre or a state that is
/// not finite.
[[nodiscard]] std::optional<KeplerElements> elements_of(const OrbitState& state,
                                                        double mu_m3_s2 = kEarthMu_m3_s2) noexcept;

/// semi_major_axis_km ... mean_anomaly_deg, or the state at the epoch, position_km and
/// velocity_km_s, three numbers each. Refused, with the key: parabolas and straight lines, an axis
/// whose sign is not the eccentricity's, and a perigee inside the Earth.
[[nodiscard]] KeplerElements read_elements(const ConfigTable& table);

}  // namespace engine
