#pragma once

#include "engine/orbit/propagator.h"

namespace engine {

/// Whether light takes time and the camera's speed tilts it. Together 33.5 px in a fast pass.
enum class LightPath : std::uint8_t { kGeometric, kApparent };

/// From camera to target at one instant.
struct SightLine {
  Epoch emitted;          ///< when the light that arrives now left the target
  OrbitState camera;      ///< now
  OrbitState target;      ///< when the light left
  double range_m = 0;     ///< between those two places
  double rate_rad_s = 0;  ///< how fast the line turns
  double range_rate_m_s = 0;
  Direction<J2000> toward_target;  ///< the light's path
  Direction<J2000> apparent;       ///< where a camera at this speed sees it
};

/// Apparent: light time by two iterations (a metre left after the first at 15 km/s and 300 km,
/// nothing after the second), aberration to first order in v/c (7e-10 rad left, 0.0005 px).
[[nodiscard]] SightLine sight_line(const Propagator& camera, const Propagator& target, Epoch now,
                                   LightPath path) noexcept;

/// The rotation that takes apparent directions near this line to the light's path.
[[nodiscard]] Rotation<J2000, J2000> without_aberration(const SightLine& line) noexcept;

/// Where an observer at this speed against the solar system's barycentre sees what is so far away
/// that it stands still: a star. Exact in v/c; Green 1985, Spherical Astronomy, section 8.3.
/// Leaves out: parallax (at most 0.8"), light deflection by the Sun (1.8" at its limb).
[[nodiscard]] Eigen::Vector3d aberrated(const Eigen::Vector3d& unit,
                                        const Velocity<J2000>& observer) noexcept;

}  // namespace engine
