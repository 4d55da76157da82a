#include "hil/guidance.h"

#include "hil/turn.h"

namespace hil {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::CameraAttitude;
using engine::OrbitState;
using engine::seconds;
using engine::SimTime;

GuidanceError read_guidance_error(const engine::ConfigTable& table) {
  const engine::Range angle = engine::between(-1e5, 1e5);
  GuidanceError error;
  error.offset_rad = {table.number_or("error_x_urad", 0.0, angle) * 1e-6,
                      table.number_or("error_y_urad", 0.0, angle) * 1e-6};
  error.growth_rad_s = {table.number_or("error_growth_x_urad_s", 0.0, angle) * 1e-6,
                        table.number_or("error_growth_y_urad_s", 0.0, angle) * 1e-6};
  return error;
}

GuidanceMode read_guidance_mode(const engine::ConfigTable& table) {
  return table.choice_or<GuidanceMode>("mode", "predicted-target",
                                       {{"predicted-target", GuidanceMode::kPredictedTarget},
                                        {"nadir", GuidanceMode::kNadir},
                                        {"inertial", GuidanceMode::kInertial},
                                        {"commanded", GuidanceMode::kCommanded}});
}

TargetKnowledge read_target_knowledge(const engine::ConfigTable& table) {
  const engine::Range distance = engine::between(-1e6, 1e6);
  return {table.number_or("target_error_along_m", 0.0, distance),
          table.number_or("target_error_cross_m", 0.0, distance),
          table.number_or("target_error_radial_m", 0.0, distance),
          table.number_or("target_error_s", 0.0, engine::between(-1e3, 1e3))};
}

OrbitState BelievedTarget::at(engine::Epoch t) const noexcept {
  OrbitState state = target_.at(t + ahead_);
  if (error_.along_m == 0.0 && error_.cross_m == 0.0 && error_.radial_m == 0.0) return state;
  // The orbital frame's axes: along the track, minus the normal, nadir.
  const Vector3d in_frame(error_.along_m, -error_.cross_m, -error_.radial_m);
  state.position.m += engine::orbital_frame(state).matrix.transpose() * in_frame;
  return state;
}

CameraAttitude Guidance::predicted(SimTime t) noexcept {
  CameraAttitude attitude = prediction_.attitude(t);
  std::array<double, 2> off{};
  for (std::size_t i = 0; i < 2; ++i)
    off[i] = error_.offset_rad[i] + error_.growth_rad_s[i] * seconds(t - error_.start);
  if (off[0] != 0.0 || off[1] != 0.0)
    attitude.axes.matrix = axes_turned({-off[1], off[0], 0.0}) * attitude.axes.matrix;
  return attitude;
}

CameraAttitude Guidance::line(SimTime t) noexcept {
  switch (mode_) {
    case GuidanceMode::kPredictedTarget:
      return predicted(t);
    case GuidanceMode::kNadir:
      return prediction_.nadir(t);
    case GuidanceMode::kInertial:
      break;
    case GuidanceMode::kCommanded:
      if (!commanded_) break;
      return {{axes_turned(rate_rad_s_ * (seconds(t) - seconds(reference_))) * axes_at_reference_},
              false};
  }
  return {{held_}, false};
}

void Guidance::set_mode(GuidanceMode mode, const Matrix3d& held) noexcept {
  mode_ = mode;
  held_ = axes_of(quaternion_of(held));  // what many products have rounded off is put right
}

void Guidance::command(const MeasuredAttitude& attitude, SimTime reference) noexcept {
  mode_ = GuidanceMode::kCommanded;
  commanded_ = true;
  axes_at_reference_ = axes_of(attitude.j2000_to_camera);
  rate_rad_s_ = Vector3d(attitude.rate_rad_s[0], attitude.rate_rad_s[1], attitude.rate_rad_s[2]);
  reference_ = reference;
}

}  // namespace hil
