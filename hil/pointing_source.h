#pragma once

#include "engine/orbit/attitude.h"
#include "engine/scene/snapshot.h"
#include "hil/camera_link.h"

namespace hil {

/// Where the camera looks. Thread: loop. Loop-safe.
class PointingSource {
 public:
  virtual ~PointingSource() = default;
  /// Pre: `t` never decreases from call to call.
  [[nodiscard]] virtual engine::CameraAttitude attitude(engine::SimTime t) noexcept = 0;
  /// The same on the way from one attitude() to the next: no sensor looks.
  [[nodiscard]] virtual engine::CameraAttitude passing(engine::SimTime t) noexcept {
    return attitude(t);
  }
  /// Takes effect from the next attitude() on.
  virtual void apply(const Command& command) noexcept = 0;
  /// What the actuator's own sensor says of the last attitude().
  [[nodiscard]] virtual TrimAngles trim_rad() const noexcept = 0;
  /// What star tracker and gyro say of the last attitude(); nothing turns unless overridden.
  [[nodiscard]] virtual MeasuredAttitude measured() const noexcept { return {}; }
};

/// The attitude over an exposure. `at_middle` is called when the last attitude() was that of
/// mid-exposure.
template <class AtMiddle>
[[nodiscard]] engine::AttitudeTrack track_over(PointingSource& pointing, engine::SimTime open,
                                               engine::Duration exposure,
                                               AtMiddle at_middle) noexcept {
  using engine::AttitudeTrack;
  AttitudeTrack track;
  track.known_between = true;
  const auto when = [&](int step) { return open + AttitudeTrack::time_of(step, exposure); };
  int step = 0;
  track.open = pointing.attitude(when(step++));
  for (auto& attitude : track.to_middle) attitude = pointing.passing(when(step++));
  track.middle = pointing.attitude(when(step++));
  at_middle();
  for (auto& attitude : track.to_close) attitude = pointing.passing(when(step++));
  track.close = pointing.attitude(when(step));
  return track;
}

}  // namespace hil
