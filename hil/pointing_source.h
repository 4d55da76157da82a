#pragma once

#include "engine/orbit/attitude.h"
#include "hil/camera_link.h"

namespace hil {

/// Where the camera looks. Thread: loop. Loop-safe.
class PointingSource {
 public:
  virtual ~PointingSource() = default;
  /// Pre: `t` never decreases from call to call.
  [[nodiscard]] virtual engine::CameraAttitude attitude(engine::SimTime t) noexcept = 0;
  /// Takes effect from the next attitude() on.
  virtual void apply(const Command& command) noexcept = 0;
  /// What the actuator's own sensor says of the last attitude().
  [[nodiscard]] virtual TrimAngles trim_rad() const noexcept = 0;
  /// What star tracker and gyro say of the last attitude(); nothing turns unless overridden.
  [[nodiscard]] virtual MeasuredAttitude measured() const noexcept { return {}; }
};

}  // namespace hil
