#pragma once

#include <array>
#include <cstdint>

#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/core/vec.h"
#include "engine/orbit/attitude.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/earth_background.h"
#include "engine/scene/image_motion.h"

namespace engine {

/// The camera's attitude over an exposure, which smear integrates: at its ends and middle, and
/// where it is `known_between`, at even steps between these.
struct AttitudeTrack {
  static constexpr int kSteps = ImagePath::kSteps;
  static constexpr int kStepsOfHalf = kSteps / 2;

  CameraAttitude open;
  CameraAttitude middle;
  CameraAttitude close;
  std::array<CameraAttitude, kStepsOfHalf - 1> to_middle{};
  std::array<CameraAttitude, kStepsOfHalf - 1> to_close{};
  bool known_between = false;

  /// After so many of kSteps. Pre: known_between.
  [[nodiscard]] const CameraAttitude& after(int steps) const noexcept {
    if (steps == 0) return open;
    if (steps == kSteps) return close;
    if (steps == kStepsOfHalf) return middle;
    const bool first_half = steps < kStepsOfHalf;
    const int i = (first_half ? steps : steps - kStepsOfHalf) - 1;
    return (first_half ? to_middle : to_close)[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] static Duration time_of(int steps, Duration exposure) noexcept {
    return exposure * steps / kSteps;
  }
};

/// What the loop asks for: when, for how long, looking where.
struct Shot {
  std::uint64_t sequence = 0;
  SimTime shutter_open{};
  Duration exposure{};
  AttitudeTrack attitude;
};

/// Parallel light that falls on the target.
struct Lamp {
  Direction<BodyFrame> toward;  ///< from the target to the lamp
  double irradiance_w_m2 = 0;   ///< across the beam, in band
};

/// The camera against the stars.
struct SkyView {
  AttitudeTrack attitude;    ///< aberration not taken out: a star's apparent direction is seen
  Position<J2000> camera;    ///< from the Earth's centre, at mid-exposure
  Velocity<J2000> velocity;  ///< against the solar system's barycentre; 0: light paths are straight
  double exposure_s = 0;
};

/// How a body is seen and lit, in its own axes.
struct BodyView {
  Position<BodyFrame> camera;                         ///< where the camera is, seen by the body
  Rotation<BodyFrame, CameraFrame> body_from_camera;  ///< aberration already taken out
  PixelPoint target_px;  ///< the image of its centre; far outside if behind the camera
  PixelPoint smear_px;   ///< how that image moves from shutter open to shutter close
  AffineMap image_map;   ///< of its image, for LocalCamera: distortion and a rolling shutter
  double range_m = 0;
  double phase_angle_rad = 0;  ///< at the body, between Sun and camera

  Lamp sun;         ///< irradiance 0 in the Earth's shadow
  Lamp earthshine;  ///< irradiance 0 when left out
  /// Earthshine again, as the rung has it: for kHarmonics and kCap a renderer that can uses this
  /// instead of the lamp, which then holds its vector irradiance. Dark for the other rungs.
  EarthLight earth;
};

/// A body besides the target.
struct CompanionView : BodyView {
  Position<BodyFrame> centre;                    ///< in the target's body frame
  Rotation<BodyFrame, BodyFrame> from_target{};  ///< takes the target's axes to its own
};
inline constexpr std::size_t kMostCompanions = 32;

/// A part of a body that turns by itself: its centre is its hinge.
struct PartView : CompanionView {
  std::size_t owner = 0;  ///< 0: the target, n: companion n - 1
  double angle_rad = 0;   ///< about its axis, from where the mesh has it
  double second_angle_rad = 0;
  bool at_limit = false;  ///< a limit keeps it from its place
};
inline constexpr std::size_t kMostParts = 32;

/// One exposure with its geometry resolved, at mid-exposure: the target's view, and all the rest.
struct Snapshot : BodyView {
  std::uint64_t sequence = 0;
  std::uint64_t seed = 0;
  SimTime shutter_open{};
  Duration exposure{};

  ImagePath path;            ///< of the target
  ImagePath boresight_path;  ///< of a star near the boresight

  double range_rate_m_s = 0;
  double line_of_sight_rate_rad_s = 0;

  SkyView sky;

  EarthshineChoice earthshine_rung;
  double background_w_m2_sr = 0;  ///< even over the field
  EarthInFrame earth_in_frame;    ///< seen from the camera; not drawn: not seen
  bool earth_behind = false;      ///< the line of sight meets the Earth beyond the target
  bool roll_is_fallback = false;
  bool attitude_is_fallback = false;  ///< the target's

  std::array<CompanionView, kMostCompanions> companion{};  ///< the first `companions` of them
  std::size_t companions = 0;
  std::array<PartView, kMostParts> part{};  ///< the first `parts` of them
  std::size_t parts = 0;
};

}  // namespace engine
