#pragma once

#include "engine/scene/mesh.h"

namespace engine {

/// A space telescope much like Hubble, as a target: built in memory, so no model file is needed.
///
/// Body frame, metres, origin on the tube's axis at the middle of its length: +x along the tube to
/// the aperture, +z to the nadir, solar wings along +-y with their cells facing -z. The Sun side is
/// -z; there the aperture door has its hinge, a right angle open. High-gain antennas along +-z.
///
/// Materials: "silicon" (solar cells), "polyimide" (all insulation, booms and panel backs), "black"
/// (inside of the tube, baffles). Every part is a closed solid; parts reach into one another where
/// they join. Under 15 000 triangles.
///
/// Sources: NASA's public figures for Hubble: 13.2 m long (the tube; the open door stands out
/// beyond it), 4.2 m across at most; wings 7.1 m by 2.6 m, as on it since 2002. The span over the
/// wings is 13.7 m. All else is estimated by eye.
/// We differ from Hubble in the door's inner face, black there, insulation here.
/// Leaves out: mirrors and instruments, wrinkles of the insulation, labels, cables, star trackers,
/// single cells; antennas and wings do not turn.
[[nodiscard]] Mesh telescope_mesh();

}  // namespace engine
