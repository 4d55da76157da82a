#pragma once

#include "engine/orbit/attitude.h"
#include "engine/orbit/propagator.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/sun.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/earth.h"
#include "engine/scene/snapshot.h"

namespace engine {

struct SceneSpec {
  Epoch epoch{};
  std::uint64_t seed = 1;
  LightPath light_path = LightPath::kApparent;
  SunSpec sun;
  EarthSpec earth;
  EarthshineSensor earthshine_sensor;  ///< for EarthshineModel::kAuto
  EulerOffsets target_offsets;
  double sky_w_m2_sr = 0;  ///< zodiacal light and what else is even over the field
  CameraGeometry camera;
};

/// Shot -> Snapshot: orbits, Sun, attitudes and lamps at the exposure's time.
/// Thread: any. Loop-safe. The propagators outlive it.
class SnapshotBuilder {
 public:
  SnapshotBuilder(const SceneSpec& spec, const Propagator& camera, const Propagator& target)
      : spec_(spec), camera_(camera), target_(target) {}

  [[nodiscard]] Snapshot build(const Shot& shot) const noexcept;

 private:
  /// Where the target's centre falls for an attitude at a time.
  [[nodiscard]] PixelPoint target_image(SimTime t, const CameraAttitude& attitude) const noexcept;
  [[nodiscard]] Rotation<BodyFrame, J2000> body_axes(const OrbitState& target) const noexcept;
  void light_up(const SightLine& line, const Position<J2000>& sun, Snapshot& out) const noexcept;
  /// What an observer sees whose axes are given; `Frame` is any.
  template <class Frame>
  [[nodiscard]] EarthDisc<Frame> earth_from(const Position<J2000>& observer,
                                            const Rotation<Frame, J2000>& axes,
                                            const Position<J2000>& sun, Epoch now) const noexcept;
  void light_by_earth(const SightLine& line, const Position<J2000>& sun,
                      const Rotation<BodyFrame, J2000>& axes, Snapshot& out) const noexcept;

  SceneSpec spec_;
  const Propagator& camera_;
  const Propagator& target_;
};

}  // namespace engine
