#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "engine/core/vec.h"
#include "engine/scene/brdf_points.h"

namespace engine {

/// A measured BRDF between its points: for every incidence a grid of the angles of scatter.
///
/// The grids may differ from one incidence to the next, their steps may be uneven. Within a grid:
/// the logarithm is bilinear in both angles; beyond its edge the edge's value holds. A reading of 0
/// has no logarithm and counts as half of the least one of its scan above 0. Between two
/// incidences points are matched that lie alike about the mirror direction, so that a narrow lobe
/// moves with it and does not become two: alike in azimuth about it and in half-vector distance,
/// |b - b0| / (2 cos theta) with b the direction's projection onto the surface (b0 the mirror's;
/// near it that is the tilt of the half vector, Rusinkiewicz 1998,
/// DOI 10.1007/978-3-7091-6453-2_2); further out the distance is bent by 1/r - 1/r(horizon), which
/// leaves the neighbourhood of the mirror as it is and puts horizon upon horizon. Above the last
/// incidence the nearest holds, moved with the mirror and of the same width in b.
///
/// Isotropic: the two sides of the plane of incidence are one, and readings of both are averaged.
/// Normal light knows no azimuth: there the mean holds of all azimuths about the mirror that the
/// first incidence measured, of the same width in b. Below that incidence it is one of the two.
/// Leaves out polarisation, colour and noise: a table's noise is part of the surface.
///
/// Thread: any. Loop-safe but for the constructor.
class BrdfGrid {
 public:
  /// Throws ConfigError with path and line: two points for one direction, holes in a grid, one
  /// incidence alone, cuts within the plane of incidence alone, no light at all.
  explicit BrdfGrid(const BrdfPoints& points);

  /// 1/sr. Pre: both unit and above the horizon.
  [[nodiscard]] double at(const Eigen::Vector3d& in, const Eigen::Vector3d& out) const noexcept;

  [[nodiscard]] std::size_t incidences() const noexcept { return measured_.size(); }
  [[nodiscard]] double incidence_rad(std::size_t i) const noexcept {
    return measured_[i].theta_in_rad;
  }
  /// Of the hemisphere, weighed by the cosine, what the grid of an incidence reaches.
  [[nodiscard]] double coverage(std::size_t i) const noexcept { return measured_[i].coverage; }
  /// Where the light of an incidence goes that does not go to the mirror: the brightest reading
  /// that none next to it passes, over 10 deg from the mirror direction and above three times the
  /// median. For light from incident_direction().
  [[nodiscard]] const std::optional<Eigen::Vector3d>& lobe_aside(std::size_t i) const noexcept {
    return measured_[i].lobe_aside;
  }
  /// The direction that is to the mirror of one incidence what `out` is to that of another.
  [[nodiscard]] Eigen::Vector3d carried(double from_in_rad, const Eigen::Vector3d& out,
                                        double to_in_rad) const noexcept;
  /// Of readings on either side of the plane of incidence, rms of (a - b) / (a + b); 0: none.
  [[nodiscard]] double left_right_rms() const noexcept { return left_right_rms_; }

 private:
  /// What was measured at one incidence.
  struct Scan {
    double theta_in_rad = 0;
    double sin_in = 0;
    double scale = 0;                ///< 2 cos theta_in
    std::vector<double> first_rad;   ///< rising
    std::vector<double> second_rad;  ///< rising, not negative
    std::vector<double> values;      ///< logarithms, by first, then second
    ScatterAngles angles = ScatterAngles::kPlanes;

    [[nodiscard]] double value(const Eigen::Vector3d& out) const noexcept;
    [[nodiscard]] bool reaches(const Eigen::Vector3d& out) const noexcept;
  };
  /// What is known of the readings of one incidence besides.
  struct Measured {
    double theta_in_rad = 0;
    double coverage = 0;
    std::optional<Eigen::Vector3d> lobe_aside;
  };
  /// Where a direction lies about the mirror direction, in a way that incidences share.
  struct Place {
    double cos_turn = 1;
    double sin_turn = 0;
    double nearness = 0;  ///< infinite at the mirror, 0 on the horizon
  };
  struct Readings;
  [[nodiscard]] static Scan scan_of(const BrdfPoints& points, Readings& readings);
  [[nodiscard]] static Eigen::Vector3d angles_of(ScatterAngles angles,
                                                 const Eigen::Vector3d& out) noexcept;
  [[nodiscard]] static Scan normal_of(const Scan& first);
  [[nodiscard]] static double coverage_of(const Scan& scan) noexcept;
  [[nodiscard]] static std::optional<Eigen::Vector3d> lobe_aside_of(const Scan& scan);
  /// Of a step from the mirror direction, forward and aside, in projection.
  [[nodiscard]] static Place place_of(double sin_in, double scale, double dx, double dy) noexcept;
  [[nodiscard]] static Eigen::Vector3d direction_at(double sin_in, double scale,
                                                    const Place& place) noexcept;
  [[nodiscard]] static double at_place(const Scan& scan, const Place& place) noexcept;

  std::vector<Scan> scans_;  ///< by rising incidence, from normal light on
  std::vector<Measured> measured_;
  double left_right_rms_ = 0;
};

}  // namespace engine
