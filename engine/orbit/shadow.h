#pragma once

#include <string_view>

#include "engine/core/vec.h"

namespace engine {

/// The ladder of the Earth's shadow, from plain to true.
enum class ShadowModel : std::uint8_t {
  kCylinder,  ///< table 2 of Li et al. 2023: a point Sun, far away; the light goes out at once
  kCone,      ///< the Sun's disc behind a round Earth: in low orbit it takes some 8 to 10 s to set
  kOblateCone,  ///< behind the flattened one: edges up to 8 s from the round Earth's
};

/// The place in axes that make a ball of the flattened Earth: z is stretched by 1 / (1 - f).
/// Lines stay lines and touching stays touching, so that a point Sun's shadow is exact. Of the
/// Sun's disc it makes an ellipse that is taken for a circle: .3 % of the penumbra, .03 s.
/// The Earth's axis is that of J2000: .1 deg off until 2030, 1e-5 of the flattening.
[[nodiscard]] Position<J2000> earth_made_round(const Position<J2000>& place) noexcept;

/// How far it is to the edge of where none of the Sun is seen, in metres: negative inside. No
/// motion by less than that changes the sign. Pre: the body is above the ground.
[[nodiscard]] double shadow_margin_m(ShadowModel model, const Position<J2000>& body,
                                     const Position<J2000>& sun) noexcept;

/// The share of the Sun's disc that a body sees past the Earth: 1 in sunlight, 0 in the umbra.
///
/// Two overlapping discs in the body's sky. Source: Montenbruck & Gill 2000, Satellite Orbits,
/// section 3.4.2, DOI 10.1007/978-3-642-58351-3. We differ from it in the radius of the Earth's:
/// the limb bends as its cone opens, by a tangent, and from the ground it is straight; theirs, the
/// angle itself, makes it bend twice as much in low orbit.
/// Leaves out: refraction and the air, in which the last of the Sun fades; that the Sun's limb is
/// darker than its middle; the Moon.
[[nodiscard]] double lit_fraction(ShadowModel model, const Position<J2000>& body,
                                  const Position<J2000>& sun) noexcept;

}  // namespace engine
