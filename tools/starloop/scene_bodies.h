#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "engine/render/other_bodies.h"
#include "engine/render/traced_target.h"
#include "engine/scene/snapshot.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// What rays can meet in a scenario: meshes taken apart at their hinges. What is the same twice is
/// there once.
struct SceneBodies {
  std::shared_ptr<engine::TracedTarget> target;
  engine::OtherBodies others;

  /// Of all bodies, each for itself.
  [[nodiscard]] std::size_t triangles() const;
  /// The names of those that any body has.
  [[nodiscard]] std::set<std::string> materials() const;
  /// A line for each material that a user should know something about.
  [[nodiscard]] std::vector<std::string> material_notes() const;
};

/// Reads the meshes. With a snapshot parts are fixed to their bodies as they stand in it, and there
/// are none that move. Throws engine::ConfigError: a mesh that cannot be used, a group that it has
/// not.
[[nodiscard]] SceneBodies make_bodies(const Scenario& scenario, const engine::Snapshot* frozen);

}  // namespace starloop
