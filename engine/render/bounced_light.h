#pragma once

#include "engine/core/random.h"
#include "engine/render/traced_target.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// Light of the lamps that reached a place by way of other places of the target, eq 12 of Li et al.
/// 2023: one path, its directions drawn from the BRDF, a lamp asked for at each place it meets.
///
/// We differ from the print: directions are drawn from a mixture that finds every direction light
/// can come from; the 15 deg cone of eq 13-14 loses 43-99 % of it. Light that bounces is taken to
/// leave the surface where the lamp struck it evenly, with the albedo of its direction: the energy
/// is kept, caustics are spread out. Followed exactly they are found by one sample in thousands,
/// and those few move the photocentre of a frame by a pixel.
/// Leaves out what took more than `bounces` bounces.
/// Thread: any. Loop-safe. The target outlives it.
class BouncedLight {
 public:
  BouncedLight(const TracedTarget& target, int bounces) : target_(target), bounces_(bounces) {}

  /// What one path brings, in W/m^2/sr, to a camera that looks at `from` along the unit vector
  /// `direction`. Its mean over paths is the radiance.
  [[nodiscard]] double radiance(const Snapshot& snapshot, SurfacePoint from,
                                Eigen::Vector3d direction, Draws& draws,
                                RayCounts& counts) const noexcept;

 private:
  [[nodiscard]] double scattered(const Snapshot& snapshot, const SurfacePoint& at, Draws& draws,
                                 RayCounts& counts) const noexcept;

  const TracedTarget& target_;
  int bounces_;
};

}  // namespace engine
