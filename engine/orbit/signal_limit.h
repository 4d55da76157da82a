#pragma once

namespace engine {

/// Whether the target is bright enough: G_p of Li et al. 2023 as a signal-to-noise limit.
///
/// The target stands in as a ball with a Lambert surface in full sunlight, which sends
/// (2/3) albedo E (radius / range)^2 (sin a + (pi - a) cos a) / pi to the camera at a phase angle
/// a (Russell 1916, Astrophysical Journal 43, 173). Its brightest pixel has as much of that as a
/// point's has, or as its disc spreads over pixels: 1 / (1 / peak_share + pi d^2 / 4), d pixels
/// wide. Noise: that of a dark pixel, and the signal's own shot noise.
/// Leaves out: glints and shape (a factor of several either way), earthshine, the Earth behind.
struct SignalLimit {
  double least_snr = 0;           ///< of the brightest pixel; 0: none
  double radius_m = 1;            ///< of the ball
  double albedo = 0.2;            ///< in [0, 1]
  double sun_w_m2 = 0;            ///< at the target, in band
  double electrons_per_w_m2 = 0;  ///< on the whole detector in an exposure, of light at the pupil
  double dark_noise_e = 0;        ///< rms, of a pixel without light
  double ifov_rad = 0;
  double peak_share = 0.4;  ///< of a point's light, in its brightest pixel

  /// Of the brightest pixel.
  [[nodiscard]] double signal_e(double range_m, double phase_angle_rad) const noexcept;
  [[nodiscard]] double snr(double range_m, double phase_angle_rad) const noexcept;
  /// The margin to `least_snr` as a way: negative where the target is too faint. No motion of
  /// target against camera by less than that changes the sign. Pre: range_m > 0.
  [[nodiscard]] double margin_m(double range_m, double phase_angle_rad) const noexcept;
};

}  // namespace engine
