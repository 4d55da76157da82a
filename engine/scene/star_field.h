#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/scene/camera_geometry.h"
#include "engine/scene/point_source.h"
#include "engine/scene/snapshot.h"
#include "engine/scene/star_catalogue.h"
#include "engine/scene/star_light.h"
#include "engine/scene/star_zones.h"

namespace engine {

/// Which stars are worth drawing. Irradiances as PointSource has them.
struct StarLimits {
  double faint_w_m2 = 0;          ///< what is fainter is left out, when it stands still
  double peak_share = 1;          ///< of a star's light, in its brightest pixel
  double reach_px3_per_w_m2 = 0;  ///< the third power of how far a star's light is followed
  double least_reach_px = 1;
  double largest_reach_px = 64;

  [[nodiscard]] double reach_px(double irradiance_w_m2) const noexcept {
    return std::clamp(std::cbrt(reach_px3_per_w_m2 * irradiance_w_m2), least_reach_px,
                      largest_reach_px);
  }
};

/// What was found in the sky. Counts that add up: near == drawn + faint + behind_earth + no_room.
struct StarsFound {
  int near = 0;  ///< stars whose light would reach the frame
  int drawn = 0;
  int faint = 0;  ///< left out by the limit
  int behind_earth = 0;
  int no_room = 0;           ///< left out because there were too many: the faintest
  int in_frame = 0;          ///< of those drawn, with their centre in the frame at mid-exposure
  double left_out_w_m2 = 0;  ///< sum of those left out by limit and room
  double largest_left_out_w_m2 = 0;
  PointSource brightest;  ///< of those in the frame
  double brightest_v = 0;
};

/// A catalogue as the camera sees it.
///
/// A star is seen where proper motion to the scenario's epoch and aberration by the camera's speed
/// put it; its streak is the straight line between its images at shutter open and close. A frame
/// looks only at the cells of sky that it meets.
/// Leaves out: parallax (at most 0.8", of the nearest), proper motion during the run (at most 0.03"
/// a day), what bends a streak, the Earth's atmosphere and flattening at its limb.
/// Thread: any. Loop-safe but for the constructor.
class StarField {
 public:
  StarField(const StarCatalogue& catalogue, const CameraGeometry& camera, const StarLight& light);

  /// Appends to `out` as far as it has capacity: too many, and the limit rises by half magnitudes.
  StarsFound find(const SkyView& sky, const StarLimits& limits,
                  std::vector<PointSource>& out) const noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return stars_.size(); }

 private:
  struct Star {
    Eigen::Vector3d unit;
    float irradiance_w_m2;
    float v_magnitude;
  };
  struct Frame;

  void look_at(const Star& star, Frame& frame, StarsFound& found,
               std::vector<PointSource>& out) const noexcept;

  CameraGeometry camera_;
  StarZones zones_;
  std::vector<std::size_t> first_;  ///< of each cell, and one more
  std::vector<Star> stars_;         ///< by cell
};

}  // namespace engine
