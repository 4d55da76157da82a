#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/far_wings.h"
#include "engine/optics/optics_spec.h"
#include "engine/optics/otf_cascade.h"
#include "engine/scene/image_motion.h"
#include "engine/scene/point_source.h"

namespace engine {

/// Points of light onto the detector, anywhere and by the thousand: what a pixel collects of a
/// point's image, from a table, instead of a transform over a window as Optics does for the target.
///
/// Within kCore_px the image of a point (OtfCascade, the pixel included) is
/// tabulated on kPhases places to a pixel; between them Lagrange's cubic: within 1e-4 of the peak
/// of the exact image, and 1e-4 px of its centroid. Further out it falls as the mean Airy pattern
/// does, lambda N / (pi^3 p (1 - obscuration) r^3), as far as the light shows; what lies beyond is
/// lost, and the loss reported. A streak is the even sum of images along its line, three Gauss
/// nodes to a pixel's length. Out of focus it is blended from tables of several
/// defocuses, in W20^2 where the sign of W20 does not matter: within 3e-3 of the light. Leaves out:
/// distortion, vignetting, how the image changes with a star's colour, and a spider's spikes beyond
/// the tables. Thread: loop. Loop-safe but for the constructor. Same bits
/// whatever the threads.
class PointSplat {
 public:
  static constexpr int kCore_px = 24;
  static constexpr int kCoreOfSpider_px = 48;
  static constexpr int kLeastReach_px = 5;
  static constexpr double kMostDefocus_waves = 0.75;  ///< more shows as that

  /// What a point stands for.
  struct Kind {
    double mean_over_px;    ///< the side of a square that it is the mean of; 0: a point
    const FarWings* wings;  ///< that are spread by others, and always in focus; none: its own
  };
  /// `faint_w_m2`: irradiance on the detector under which light need not be followed.
  PointSplat(const OpticsSpec& spec, const OtfCascade& cascade, double faint_w_m2, WorkerPool& pool,
             const Kind& kind = {0.0, nullptr});

  /// How far out of focus the points are from now on; at first they are in it.
  void focus(double defocus_m) noexcept;

  struct Report {
    std::uint64_t footprints = 0;  ///< images that were added up
    double lost_flux_share = 0;    ///< of the points' light, beyond where it was followed
  };
  /// Adds to `out`, of the camera's size. `path`: how far off their own even motions all points
  /// are. `least_reach_px`: how far to follow each point's light at least, of points that are parts
  /// of one.
  Report add(std::span<const PointSource> points, const ImagePath& path, IrradianceImage& out,
             double least_reach_px = kLeastReach_px) noexcept;

  /// Of a point's light, in the pixel on whose centre it falls.
  [[nodiscard]] double peak_share() const noexcept { return peak_share_; }
  /// Irradiance on the detector, summed over pixels, for one W/m^2 at the pupil.
  [[nodiscard]] double pixels_per_irradiance() const noexcept { return gain_; }
  /// How far a point's light is followed: the third root of this times its irradiance.
  [[nodiscard]] double reach_px3_per_w_m2() const noexcept { return airy_ * gain_ / faint_w_m2_; }
  [[nodiscard]] double largest_reach_px() const noexcept { return largest_reach_px_; }
  [[nodiscard]] double reach_px(double irradiance_w_m2) const noexcept;

 private:
  static constexpr int kPhases = 16;           // to a pixel
  static constexpr int kTables = kPhases + 3;  // an axis, with what the cubic needs at the ends

  struct Band;
  struct Footprint;

  /// The image at one defocus, on kPhases places to a pixel.
  struct Level {
    double measure = 0;         ///< of the defocus: what blending is even in
    std::vector<float> shares;  ///< [phase v][phase u][row][column]
  };
  void add_level(const OtfCascade& cascade, const Kind& kind, double defocus_m);
  [[nodiscard]] double measure(double defocus_m) const noexcept;
  void streak(const PointSource& point, double followed_px, const Band& band, IrradianceImage& out,
              std::uint64_t& footprints) const noexcept;
  void follow(const PointSource& point, const ImagePath& path, double followed_px, const Band& band,
              IrradianceImage& out, std::uint64_t& footprints) const noexcept;
  void stamp(const Footprint& print, const Band& band, IrradianceImage& out) const noexcept;
  void add_core(const Footprint& print, const Level& level, double weight, const Band& band,
                IrradianceImage& out) const noexcept;
  void add_wings(const Footprint& print, const Band& band, IrradianceImage& out) const noexcept;
  [[nodiscard]] const float* table_row(const Level& level, int phase_v, int phase_u,
                                       int row) const noexcept;

  int width_px_;
  int height_px_;
  int core_px_;
  int stride_;  ///< of a row of a table
  double gain_;
  double airy_;
  double faint_w_m2_;
  double largest_reach_px_;
  double wave_m_;
  double peak_share_ = 0;
  WorkerPool& pool_;
  bool even_;                              ///< defocus of either sign is the same
  std::vector<Level> levels_;              ///< rising
  std::size_t lower_ = 0;                  ///< the level below the focus
  double upper_share_ = 0;                 ///< of the next one
  std::vector<std::uint64_t> footprints_;  ///< one a band of rows
};

}  // namespace engine
