#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/orbit/body_attitude.h"
#include "engine/orbit/held_offset.h"
#include "engine/orbit/orbit_spec.h"
#include "engine/scene/mesh_spec.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// A body besides the target: companions.<name> of a scenario.
struct CompanionSpec {
  std::string name;
  MeshSpec mesh;
  std::optional<OrbitSpec> orbit;  ///< none: it is held beside another body
  std::size_t beside = 0;          ///< 0: the target, n: companion n - 1
  OrbitalOffset offset;            ///< where it has no orbit of its own
  /// From its own orbital frame; where it is held, from that of the body with an orbit that it is
  /// held to in the end.
  AttitudeSpec attitude;
};
/// Reads companions.<name> for each name below `companions`, kMostCompanions at most. None is held
/// to itself, by others or directly.
[[nodiscard]] std::vector<CompanionSpec> read_companions(const ConfigReader& config);

/// A companion as it moves. The propagators outlive it.
struct Companion {
  const Propagator& place;
  const Propagator& upright;  ///< whose orbital frame its attitude is counted from
  BodyAttitude attitude;

  [[nodiscard]] Rotation<BodyFrame, J2000> axes(Epoch t) const noexcept {
    return attitude.axes(t, upright.at(t));
  }
};

}  // namespace engine
