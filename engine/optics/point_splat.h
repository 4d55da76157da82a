#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/far_wings.h"
#include "engine/optics/optics_spec.h"
#include "engine/scene/point_source.h"

namespace engine {

/// Points of light onto the detector, anywhere and by the thousand: what a pixel collects of a
/// point's image, from a table, instead of a transform over a window as Optics does for the target.
///
/// Within kCore_px the image of a point (diffraction over the band, times the pixel's square) is
/// tabulated on kPhases places to a pixel; between them Lagrange's cubic: within 1e-4 of the peak
/// of the exact image, and 1e-4 px of its centroid. Further out it falls as the mean Airy pattern
/// does, lambda N / (pi^3 p (1 - obscuration) r^3), as far as the light shows; what lies beyond is
/// lost, and the loss reported. A streak is the even sum of images along its line, three Gauss
/// nodes to a pixel's length. Leaves out: defocus, distortion, vignetting, and how the image
/// changes with a star's colour. Thread: loop. Loop-safe but for the constructor. Same bits
/// whatever the threads.
class PointSplat {
 public:
  static constexpr int kCore_px = 24;
  static constexpr int kLeastReach_px = 5;

  /// What a point stands for.
  struct Kind {
    double mean_over_px;    ///< the side of a square that it is the mean of; 0: a point
    const FarWings* wings;  ///< that are spread by others; none: its own
  };
  /// `faint_w_m2`: irradiance on the detector under which light need not be followed.
  PointSplat(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool,
             const Kind& kind = {0.0, nullptr});

  struct Report {
    std::uint64_t footprints = 0;  ///< images that were added up
    double lost_flux_share = 0;    ///< of the points' light, beyond where it was followed
  };
  /// Adds to `out`, of the camera's size. `least_reach_px`: how far to follow each point's light at
  /// least, of points that are parts of one.
  Report add(std::span<const PointSource> points, IrradianceImage& out,
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

  void fill_tables(const OpticsSpec& spec, const Kind& kind);
  void streak(const PointSource& point, double followed_px, const Band& band, IrradianceImage& out,
              std::uint64_t& footprints) const noexcept;
  void stamp(const Footprint& print, const Band& band, IrradianceImage& out) const noexcept;
  void add_core(const Footprint& print, const Band& band, IrradianceImage& out) const noexcept;
  void add_wings(const Footprint& print, const Band& band, IrradianceImage& out) const noexcept;
  [[nodiscard]] const float* table_row(int phase_v, int phase_u, int row) const noexcept;

  int width_px_;
  int height_px_;
  int core_px_;
  int stride_;  ///< of a row of a table
  double gain_;
  double airy_;
  double faint_w_m2_;
  double largest_reach_px_;
  double peak_share_ = 0;
  WorkerPool& pool_;
  std::vector<float> tables_;              ///< [phase v][phase u][row][column]
  std::vector<std::uint64_t> footprints_;  ///< one a band of rows
};

}  // namespace engine
