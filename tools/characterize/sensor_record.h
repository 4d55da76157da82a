#pragma once

#include <vector>

#include "engine/core/time.h"
#include "tools/characterize/bench.h"
#include "tools/characterize/photon_transfer.h"

namespace characterize {

/// How much a record takes.
struct RecordPlan {
  int levels = 50;  ///< of light, evenly from dark to saturation
  /// Values of pixels at each level: so many frames as that takes, 2 to 32.
  std::size_t level_values = std::size_t{2} << 20;
  std::size_t stack_values = std::size_t{64} << 20;  ///< that show a pattern: 16 to 64 frames
};

/// An even number of frames that have so many values of pixels together, between two limits.
[[nodiscard]] int frames_for(std::size_t values, const engine::CameraGeometry& camera, int least,
                             int most);

/// What a stack of frames says.
struct StackFigures {
  double exposure_s = 0;
  Quantity mean_dn;
  Quantity variance_dn2;  ///< temporal
  Quantity spatial_variance_dn2;
  double share_at_zero = 0;  ///< of the values

  /// Whether it shows the dark noise as it is: not cut off at 0 DN, and no less than the quantiser
  /// lets through.
  [[nodiscard]] bool cut_off() const noexcept { return share_at_zero > 1e-3; }
  [[nodiscard]] bool shows_noise() const noexcept {
    return !cut_off() && variance_dn2.value >= kLeastVariance_dn2;
  }
};

struct Defect {
  std::size_t pixel = 0;  ///< in raster order
  bool in_dark = false;   ///< seen without light; else by its response alone
};

/// All that one bench session measures of a sensor.
struct SensorRecord {
  double exposure_s = 0;           ///< of all levels of light
  std::vector<Defect> defects;     ///< left out of all that follows
  PixelMask used;                  ///< the others
  std::vector<LightLevel> light;   ///< in order, the first dark
  std::vector<StackFigures> dark;  ///< by exposure; the first the shortest there is
  StackFigures dark_stack;         ///< of many frames, at exposure_s
  StackFigures long_dark_stack;    ///< at the longest exposure
  StackFigures half_stack;         ///< at half of saturation
  Quantity brightest_dn;           ///< mean at twice the light that saturates
};

/// Pixels further than so many robust sigmas from the median, without light at the longest exposure
/// or at half of saturation, are defects.
inline constexpr double kDefectSigmas = 6;

/// Throws std::runtime_error for a sensor that no light saturates.
[[nodiscard]] SensorRecord record_sensor(Bench& bench, engine::Duration exposure,
                                         const RecordPlan& plan);

}  // namespace characterize
