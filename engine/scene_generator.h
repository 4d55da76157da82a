#pragma once

#include <limits>

#include "engine/core/image.h"
#include "engine/optics/optics.h"
#include "engine/render/renderer.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// What a frame really shows, before noise. The software under test never sees it.
struct FrameTruth {
  double range_m = 0;
  double range_rate_m_s = 0;
  double line_of_sight_rate_rad_s = 0;
  double phase_angle_rad = 0;
  PixelPoint target_px;  ///< the image of the target's centre, in or out of the frame
  /// The centre of the target's light on the detector, free of noise and not clipped at full well;
  /// not a number when none of it falls there.
  PixelPoint photocentre_px{std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::quiet_NaN()};
  double smear_px = 0;
  double peak_e = 0;  ///< of the target's light
  double sun_irradiance_w_m2 = 0;
  double earthshine_w_m2 = 0;
  bool earth_behind = false;
  bool roll_is_fallback = false;
};

/// How long each stage took. All zero when nobody gave the chain a stopwatch.
struct StageTimes {
  Duration geometry{};
  Duration render{};
  Duration optics{};
  Duration detector{};
};

struct FrameReport {
  FrameTruth truth;
  RenderReport render;
  OpticsReport optics;
  StageTimes times;
  int peak_dn = 0;
};

/// The engine seen from outside: a frame as a function of time, attitude and seed.
/// Thread: loop. Loop-safe.
class SceneGenerator {
 public:
  virtual ~SceneGenerator() = default;
  /// Overwrites `out`.
  virtual FrameReport expose(const Shot& shot, Budget budget, DnImage& out) noexcept = 0;
};

}  // namespace engine
