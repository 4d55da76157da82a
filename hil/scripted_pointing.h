#pragma once

#include "engine/orbit/propagator.h"
#include "engine/orbit/sight_line.h"
#include "hil/pointing_source.h"

namespace hil {

/// Follows the predicted apparent line of sight to the target, and obeys nobody.
class ScriptedPointing final : public PointingSource {
 public:
  /// The propagators outlive it.
  ScriptedPointing(const engine::Propagator& camera, const engine::Propagator& target,
                   engine::Epoch epoch, engine::LightPath path)
      : camera_(camera), target_(target), epoch_(epoch), path_(path) {}

  [[nodiscard]] engine::CameraAttitude attitude(engine::SimTime t) noexcept override {
    const engine::Epoch now = epoch_ + t.time_since_epoch();
    return engine::look_along(engine::sight_line(camera_, target_, now, path_).apparent);
  }
  void apply(const Command& /*command*/) noexcept override {}
  [[nodiscard]] TrimAngles trim_rad() const noexcept override { return {}; }

 private:
  const engine::Propagator& camera_;
  const engine::Propagator& target_;
  engine::Epoch epoch_;
  engine::LightPath path_;
};

}  // namespace hil
