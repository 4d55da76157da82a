#include "hil/closed_loop_pointing.h"

namespace hil {

using engine::CameraAttitude;
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

CameraAttitude ClosedLoopPointing::attitude(SimTime t) noexcept {
  std::array<double, 2> off{};
  for (std::size_t i = 0; i < 2; ++i) {
    axes_[i].advance_to(t);
    off[i] = error_.offset_rad[i] + error_.growth_rad_s[i] * engine::seconds(t - error_.start) +
             axes_[i].angle_rad();
  }
  CameraAttitude attitude = prediction_.attitude(t);
  // Tilt the boresight by off[0] towards x and off[1] towards y: one turn about the axis across.
  const double angle = std::hypot(off[0], off[1]);
  if (angle > 0.0) {
    const Eigen::Vector3d axis(-off[1] / angle, off[0] / angle, 0.0);
    // Passive: the axes turn, so the matrix is that of the opposite turn.
    attitude.axes.matrix =
        Eigen::AngleAxisd(-angle, axis).toRotationMatrix() * attitude.axes.matrix;
  }
  return attitude;
}

void ClosedLoopPointing::apply(const Command& command) noexcept {
  if (command.kind != CommandKind::kTrim) return;
  for (std::size_t i = 0; i < 2; ++i)
    axes_[i].follow(command.trim_offset_rad[i], command.trim_rate_rad_s[i], command.reference);
}

}  // namespace hil
