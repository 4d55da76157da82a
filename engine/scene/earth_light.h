#pragma once

#include "engine/scene/earth_disc.h"

namespace engine {

/// The light of the visible, sunlit cap of the Earth at a place in space: for renderers that
/// sample it as an area light, for those that need what a facet receives, and for lamps.
///
/// Directions lead from the place to the Earth and are unit vectors in body axes.
/// Where the albedo goes by place, its coasts leave an error in the integrals below. Of the scalar
/// irradiance, the worst of 560 places and Suns: .3 % from up to 800 km, 1.3 % from up to 2000 km,
/// 2.4 % from 36 000 km, there of a thin crescent; rms .1, .2 and .5 %.
/// Thread: any. Loop-safe; making one takes some 10 us, three times that with the albedo by place.
class EarthLight {
 public:
  struct Sample {
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    double pdf = 0;  ///< per steradian; 0: there is no light
    double radiance_w_m2_sr = 0;
  };

  EarthLight() = default;  ///< dark
  explicit EarthLight(const EarthDisc<BodyFrame>& disc) noexcept;

  [[nodiscard]] bool dark() const noexcept { return !(widest_ > 0.0); }
  [[nodiscard]] const EarthDisc<BodyFrame>& disc() const noexcept { return disc_; }
  /// 0 beyond the limb and on the night side.
  [[nodiscard]] double radiance_w_m2_sr(const Eigen::Vector3d& direction) const noexcept {
    return disc_.radiance_w_m2_sr(direction);
  }
  /// No direction is brighter.
  [[nodiscard]] double largest_radiance_w_m2_sr() const noexcept { return largest_w_m2_sr_; }

  /// A direction to the lit part of the cap, for two numbers in [0, 1). Rings about the nadir have
  /// equal chances by solid angle; in a ring, so have all directions that the Sun lights.
  [[nodiscard]] Sample sample(double u1, double u2) const noexcept;
  /// Of `sample`, per steradian. Above 0 wherever the radiance is.
  [[nodiscard]] double pdf(const Eigen::Vector3d& direction) const noexcept;

  /// The integral of L w dw: it points to where the light comes from, and its length is what a
  /// facet that faces it receives. Exact for every facet that sees the whole visible cap.
  /// Source: Montenbruck & Gill 2000, Satellite Orbits, section 3.4, has the same for forces.
  [[nodiscard]] const Eigen::Vector3d& vector_irradiance_w_m2() const noexcept { return first_; }
  /// The integral of L dw: no facet receives more.
  [[nodiscard]] double scalar_irradiance_w_m2() const noexcept { return zeroth_; }

  /// The integral of what an albedo by place changes, brighter or darker: |L - L'| dw, L' being the
  /// light of each latitude's own mean. 0 without.
  [[nodiscard]] double moved_by_map_w_m2() const noexcept { return by_map_; }

  /// What a facet receives that sees nothing but the Earth and space, by spherical harmonics up to
  /// order 2: Ramamoorthi & Hanrahan 2001, DOI 10.1145/383259.383317. Written as moments of the
  /// light: with c = n.w, max(c, 0) is 3/32 + c/2 + 15/32 c^2 up to that order.
  /// Never negative. Wrong by 3/32 of the scalar irradiance at most. Measured, of the best tilt's:
  /// from 420 km 2.0 % with the Sun up to 80 deg from the zenith, 3.2 % at 90, 6.6 % at 95, where
  /// the lit part is narrow; from 40 000 km 7 %.
  [[nodiscard]] double irradiance_w_m2(const Eigen::Vector3d& normal) const noexcept {
    const double e = 3.0 / 32.0 * zeroth_ + 0.5 * first_.dot(normal) +
                     15.0 / 32.0 * normal.dot(second_ * normal);
    return e > 0.0 ? e : 0.0;
  }
  static constexpr double kHarmonicsError = 3.0 / 32.0;  ///< of the scalar irradiance

 private:
  /// A ring of directions about the nadir, and the ground that it meets.
  struct Ring {
    double sin_nadir = 0;
    double cos_nadir = 1;
    double sin_centre = 0;  ///< of the angle at the Earth's centre
    double cos_centre = 1;
    double lit_rad = 0;  ///< half of the azimuths, from the Sun's, that are lit; 0 to pi
  };
  [[nodiscard]] Ring ring_at(double versed_nadir) const noexcept;
  [[nodiscard]] double versed_nadir_of(double sin_centre, double cos_centre) const noexcept;
  [[nodiscard]] Eigen::Vector3d direction_in(const Ring& ring, double azimuth) const noexcept;
  void add_moments(double from, double to) noexcept;

  EarthDisc<BodyFrame> disc_;
  Eigen::Vector3d across_ = Eigen::Vector3d::UnitX();  ///< horizontal, on the Sun's side
  Eigen::Vector3d beside_ = Eigen::Vector3d::UnitY();
  double sun_up_ = 0;      ///< the Sun's height at the foot point, its sine
  double sun_across_ = 0;  ///< and its cosine
  // Where rings with light begin and end, by 1 - cos of the angle from the nadir.
  double narrowest_ = 0;
  double widest_ = 0;
  double largest_w_m2_sr_ = 0;
  double zeroth_ = 0;
  double by_map_ = 0;
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second_ = Eigen::Matrix3d::Zero();
};

}  // namespace engine
