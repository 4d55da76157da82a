#pragma once

#include "hil/scripted_pointing.h"

namespace hil {

/// How wrong the predicted line of sight is: offsets that grow from `start` on.
struct GuidanceError {
  TrimAngles offset_rad{};
  TrimAngles growth_rad_s{};
  engine::SimTime start{};
};
[[nodiscard]] GuidanceError read_guidance_error(const engine::ConfigTable& table);
[[nodiscard]] GuidanceMode read_guidance_mode(const engine::ConfigTable& table);

/// How wrong the target's orbit is known: where it is believed to be, less where it is.
struct TargetKnowledge {
  double along_m = 0;   ///< along the track, perpendicular to the radius
  double cross_m = 0;   ///< along the orbit's normal
  double radial_m = 0;  ///< away from the Earth
  double ahead_s = 0;   ///< it is believed to be where it will be so much later
};
[[nodiscard]] TargetKnowledge read_target_knowledge(const engine::ConfigTable& table);

/// The target where guidance believes it to be. The error in velocity that would go with a wrong
/// place is left out.
class BelievedTarget final : public engine::Propagator {
 public:
  /// The target outlives it.
  BelievedTarget(const engine::Propagator& target, const TargetKnowledge& error) noexcept
      : target_(target), error_(error), ahead_(engine::from_seconds(error.ahead_s)) {}
  [[nodiscard]] engine::OrbitState at(engine::Epoch t) const noexcept override;

 private:
  const engine::Propagator& target_;
  TargetKnowledge error_;
  engine::Duration ahead_;
};

/// The line that the camera follows before trims: a function of time, until someone sets another.
/// Thread: loop. Loop-safe.
class Guidance {
 public:
  Guidance(const ScriptedPointing& prediction, const GuidanceError& error) noexcept
      : prediction_(prediction), error_(error) {}

  [[nodiscard]] engine::CameraAttitude line(engine::SimTime t) noexcept;
  /// Inertial, and commanded as long as nobody has commanded an attitude: it stays at `held`.
  void set_mode(GuidanceMode mode, const Eigen::Matrix3d& held) noexcept;
  /// Sets kCommanded. Pre: `attitude` is finite and turns no faster than a camera does.
  void command(const MeasuredAttitude& attitude, engine::SimTime reference) noexcept;
  [[nodiscard]] GuidanceMode mode() const noexcept { return mode_; }

 private:
  [[nodiscard]] engine::CameraAttitude predicted(engine::SimTime t) noexcept;

  ScriptedPointing prediction_;
  GuidanceError error_;
  GuidanceMode mode_ = GuidanceMode::kPredictedTarget;
  Eigen::Matrix3d held_ = Eigen::Matrix3d::Identity();
  // The last attitude command.
  bool commanded_ = false;
  Eigen::Matrix3d axes_at_reference_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d rate_rad_s_ = Eigen::Vector3d::Zero();
  engine::SimTime reference_{};
};

}  // namespace hil
