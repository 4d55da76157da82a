#pragma once

#include "engine/core/time.h"
#include "engine/core/vec.h"

namespace engine {

/// From J2000 to axes that turn with the ground: IAU 2000's Earth rotation angle about J2000's
/// pole, for what asks where the continents are. Source: IERS Conventions 2010, section 5.5.3;
/// ERFA. Within .15 deg, 17 km on the ground, until 2030. Leaves out: precession and nutation of
/// the pole (20" a year since 2000), UT1 - UTC (.9 s at most, 14"), the pole's own wandering.
/// Loop-safe.
[[nodiscard]] Rotation<EarthFixed, J2000> earth_rotation(Epoch t) noexcept;

}  // namespace engine
