#pragma once

#include <utility>
#include <vector>

#include "engine/core/contract.h"
#include "engine/orbit/body_attitude.h"
#include "engine/orbit/propagator.h"
#include "engine/orbit/shadow.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/sun.h"
#include "engine/scene/articulated_part.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/companion.h"
#include "engine/scene/earth.h"
#include "engine/scene/snapshot.h"

namespace engine {

struct SceneSpec {
  Epoch epoch{};
  std::uint64_t seed = 1;
  LightPath light_path = LightPath::kApparent;
  SunSpec sun;
  ShadowModel shadow = ShadowModel::kOblateCone;  ///< the Earth's, on all bodies
  EarthSpec earth;
  EarthshineSensor earthshine_sensor;  ///< for EarthshineModel::kAuto
  AttitudeSpec target_attitude;
  double sky_w_m2_sr = 0;  ///< zodiacal light and what else is even over the field
  CameraGeometry camera;
};

/// Shot -> Snapshot: orbits, Sun, attitudes and lamps at the exposure's time.
/// Where bodies are to each other is taken at one instant, when the light left the target: light
/// needs 3 us for a kilometre, and what throws a shadow moves .03 m on meanwhile. Each is seen as
/// it was when its own light left it. Smear is the target's for all that is in the frame but stars.
/// A part stands as it does at mid-exposure, and moves with its body.
/// Leaves out: of a rolling shutter, how motion changes while the rows are read.
/// Thread: any. Loop-safe. The propagators outlive it.
class SnapshotBuilder {
 public:
  /// Pre: at most kMostCompanions and kMostParts, and parts of bodies that there are.
  SnapshotBuilder(const SceneSpec& spec, const Propagator& camera, const Propagator& target,
                  std::vector<Companion> companions = {}, std::vector<ArticulatedPart> parts = {});

  [[nodiscard]] Snapshot build(const Shot& shot) const noexcept;
  [[nodiscard]] std::size_t companions() const noexcept { return companions_.size(); }

 private:
  using BodyAxes = Rotation<BodyFrame, J2000>;
  /// Where a body is when the light that is seen leaves it.
  struct Placed {
    SightLine line;
    BodyAxes axes;
  };

  /// Where a body's centre falls for an attitude at a time.
  [[nodiscard]] PixelPoint image_of(const Propagator& body, SimTime t,
                                    const CameraAttitude& attitude) const noexcept;
  /// How the target's image moves, and a star's.
  void follow(const Shot& shot, Snapshot& out) const noexcept;
  void see(const Propagator& body, const SightLine& line, const BodyAxes& axes, const Shot& shot,
           BodyView& out) const noexcept;
  EarthshineChoice light_up(const SightLine& line, const BodyAxes& axes, const Position<J2000>& sun,
                            BodyView& out) const noexcept;
  /// 0: the target, n: companion n - 1.
  [[nodiscard]] Placed place(std::size_t body, const Shot& shot) const noexcept;
  void add_companions(const SightLine& line, const BodyAxes& axes, const Position<J2000>& sun,
                      const Shot& shot, Snapshot& out) const noexcept;
  void add_parts(const Position<J2000>& sun, const Shot& shot, Snapshot& out) const noexcept;
  /// From the part's hinge to what it follows, in its body's axes.
  [[nodiscard]] static Eigen::Vector3d toward_followed(const PartSpec& part, const Placed& owner,
                                                       const Snapshot& seen) noexcept;
  /// What an observer sees whose axes are given; `Frame` is any.
  template <class Frame>
  [[nodiscard]] EarthDisc<Frame> earth_from(const Position<J2000>& observer,
                                            const Rotation<Frame, J2000>& axes,
                                            const Position<J2000>& sun, Epoch now) const noexcept;
  EarthshineChoice light_by_earth(const SightLine& line, const BodyAxes& axes,
                                  const Position<J2000>& sun, BodyView& out) const noexcept;

  SceneSpec spec_;
  const Propagator& camera_;
  const Propagator& target_;
  std::vector<Companion> companions_;
  std::vector<ArticulatedPart> parts_;
  BodyAttitude attitude_;  ///< of the target
};

}  // namespace engine
