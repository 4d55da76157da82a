#pragma once

#include <optional>

#include "engine/orbit/propagator.h"
#include "engine/orbit/sight_line.h"
#include "hil/pointing_source.h"

namespace hil {

/// What the camera's roll is held to: the image's x grows away from it.
enum class RollRule : std::uint8_t {
  kCelestial,  ///< the Earth's axis: eq 8 of Li et al. 2023; turns fast near the celestial poles
  kVertical,   ///< the local vertical: x grows towards the Earth
};

/// Follows the predicted apparent line of sight to the target, or holds a fixed attitude, and obeys
/// nobody.
class ScriptedPointing final : public PointingSource {
 public:
  /// The propagators outlive it.
  ScriptedPointing(const engine::Propagator& camera, const engine::Propagator& target,
                   engine::Epoch epoch, engine::LightPath path, RollRule roll,
                   const std::optional<engine::CameraAttitude>& fixed = {})
      : camera_(camera), target_(target), epoch_(epoch), path_(path), roll_(roll), fixed_(fixed) {}

  [[nodiscard]] engine::CameraAttitude attitude(engine::SimTime t) noexcept override {
    if (fixed_) return *fixed_;
    const engine::Epoch now = epoch_ + t.time_since_epoch();
    const engine::SightLine line = engine::sight_line(camera_, target_, now, path_);
    if (roll_ == RollRule::kCelestial) return engine::look_along(line.apparent);
    return engine::look_along(line.apparent,
                              engine::direction_of<engine::J2000>(line.camera.position.m));
  }
  /// Nadir: boresight to the Earth's centre, by geometry; x along the track.
  [[nodiscard]] engine::CameraAttitude nadir(engine::SimTime t) const noexcept {
    const engine::OrbitState state = camera_.at(epoch_ + t.time_since_epoch());
    return {{engine::orbital_frame(state).matrix}, engine::moves_straight(state)};
  }
  void apply(const Command& /*command*/) noexcept override {}
  [[nodiscard]] TrimAngles trim_rad() const noexcept override { return {}; }

 private:
  const engine::Propagator& camera_;
  const engine::Propagator& target_;
  engine::Epoch epoch_;
  engine::LightPath path_;
  RollRule roll_;
  std::optional<engine::CameraAttitude> fixed_;
};

}  // namespace hil
