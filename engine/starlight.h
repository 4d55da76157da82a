#pragma once

#include <vector>

#include "engine/detector/detector.h"
#include "engine/optics/field_shading.h"
#include "engine/optics/point_splat.h"
#include "engine/render/renderer.h"
#include "engine/scene/star_field.h"

namespace engine {

/// What a frame shows of the stars. In electrons before saturation; all zero without a catalogue.
/// Counts that add up: near == drawn + faint + behind_earth + no_room.
struct StarReport {
  int near = 0;  ///< stars whose light would reach the frame
  int drawn = 0;
  int faint = 0;  ///< left out since the detector could not tell
  int behind_earth = 0;
  int no_room = 0;             ///< left out since there were too many
  int in_frame = 0;            ///< of those drawn, centred in the frame at mid-exposure
  int dimmed = 0;              ///< of those drawn, at least partly behind the target
  double left_out_e = 0;       ///< all the light of those left out
  double left_out_peak_e = 0;  ///< at most so much of it in one pixel, from one star
  double lost_flux_share = 0;  ///< of the light drawn, spread too far to be followed
  PixelPoint brightest_px;     ///< of those in the frame
  double brightest_v = 0;      ///< its magnitude
  double brightest_e = 0;      ///< all its light
};

/// The stars of a frame, from the catalogue to blurred light on the detector.
///
/// A star is left out when its brightest pixel would get no more than a tenth of the noise of a
/// dark one. Behind the target it is dimmed by the share of its path there that the target covers.
/// Thread: loop. Loop-safe but for the constructor.
class Starlight {
 public:
  static constexpr double kUnseenShareOfNoise = 0.1;
  static constexpr std::size_t kMostStars = 131072;  ///< that one frame draws

  /// `splat` outlives this.
  Starlight(StarField field, PointSplat& splat, const DetectorSpec& detector);

  /// Adds the stars to `out`, the blurred image of all else. `in` is what the target's image was
  /// made of; `defocus_m` is W20 of the stars, and `shading` the lens'.
  StarReport add(const Snapshot& snapshot, const Radiance& in, double background_w_m2,
                 double defocus_m, const FieldShading& shading, IrradianceImage& out) noexcept;

 private:
  StarField field_;
  PointSplat& splat_;
  DetectorSpec detector_;
  std::vector<PointSource> drawn_;
};

/// The share of a star's path, as the target sees it pass, that the target leaves free.
[[nodiscard]] double share_beside_target(const Radiance& in, const PointSource& star) noexcept;

}  // namespace engine
