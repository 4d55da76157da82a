#pragma once

#include "hil/actuator.h"
#include "hil/scripted_pointing.h"

namespace hil {

/// How wrong the prediction is: offsets that grow from `start` on.
struct GuidanceError {
  TrimAngles offset_rad{};
  TrimAngles growth_rad_s{};
  engine::SimTime start{};
};
[[nodiscard]] GuidanceError read_guidance_error(const engine::ConfigTable& table);

/// Follows the predicted line of sight, wrongly, and lets commands trim it through an actuator.
/// The prediction itself stays outside the actuator: only trims pass through it.
class ClosedLoopPointing final : public PointingSource {
 public:
  ClosedLoopPointing(const ScriptedPointing& prediction, const GuidanceError& error,
                     const ActuatorSpec& actuator)
      : prediction_(prediction), error_(error), axes_{Actuator(actuator), Actuator(actuator)} {}

  [[nodiscard]] engine::CameraAttitude attitude(engine::SimTime t) noexcept override;
  /// Reports change nothing; a trim replaces the one before.
  void apply(const Command& command) noexcept override;
  [[nodiscard]] TrimAngles trim_rad() const noexcept override {
    return {axes_[0].angle_rad(), axes_[1].angle_rad()};
  }

 private:
  ScriptedPointing prediction_;
  GuidanceError error_;
  std::array<Actuator, 2> axes_;
};

}  // namespace hil
