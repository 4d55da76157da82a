#pragma once

#include "engine/core/config_reader.h"
#include "engine/orbit/propagator.h"

namespace engine {

/// Offsets of the body from its orbital frame: body = R_y(pitch) R_x(roll) R_z(yaw), passive.
/// Eq 3 of Li et al. 2023.
struct EulerOffsets {
  double pitch_rad = 0;
  double roll_rad = 0;
  double yaw_rad = 0;
};
[[nodiscard]] EulerOffsets read_offsets(const ConfigTable& table);

/// x along track, y minus the orbit normal, z nadir. Eq 2 of Li et al. 2023, from position and
/// velocity. x is along track as a perpendicular to nadir, not along the velocity; where
/// moves_straight(), at the J2000 axis furthest from nadir. Pre: not at the Earth's centre.
[[nodiscard]] Rotation<OrbitalFrame, J2000> orbital_frame(const OrbitState& state) noexcept;
/// Motion straight up or down, to 1e-9 rad: an orbital frame has no answer of its own for it.
[[nodiscard]] bool moves_straight(const OrbitState& state) noexcept;

[[nodiscard]] Rotation<BodyFrame, OrbitalFrame> body_offset(const EulerOffsets& offsets) noexcept;

/// Where a camera's axes point.
struct CameraAttitude {
  Rotation<CameraFrame, J2000> axes;
  bool roll_is_fallback = false;  ///< the rule for the roll had no answer here
};

/// A camera that looks along `boresight`, rolled so that y, down in the image, is perpendicular to
/// `axis` and x grows away from it.
/// With the Earth's axis this is eq 8 of Li et al. 2023, without its arccos and sign. Within 1e-9
/// rad of the axis the rule has no answer; y is then taken from the J2000 axis that lies furthest
/// from the boresight, and the attitude says so.
[[nodiscard]] CameraAttitude look_along(const Direction<J2000>& boresight,
                                        const Direction<J2000>& axis = {}) noexcept;

}  // namespace engine
