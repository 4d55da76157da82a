#pragma once

#include <array>
#include <cstddef>

#include "engine/core/config_reader.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

/// The lens as the table [optics] tells of it: aperture, what stands in it, and its errors.
///
/// Wavefronts are path that light has travelled too far at a place of the pupil, in metres. Places
/// in the pupil are in units of its radius along the detector's u and v: where the wavefront grows
/// towards u, light moves towards u.
/// Leaves out: how the errors change over the field, and the glass' colours.
struct LensSpec {
  static constexpr std::size_t kLastZernike = 37;

  double focal_length_m = 4.5;
  double aperture_m = 0.36;
  double obscuration = 0;  ///< diameter ratio in [0, 1)
  double band_low_m = 450e-9;
  double band_high_m = 850e-9;

  int spider_vanes = 0;  ///< in [0, 12], evenly spaced, each from the centre to the rim
  double spider_width_m = 0;
  double spider_angle_rad = 0;  ///< of the first vane, from u towards v

  /// Place j holds Noll's term j; 0 to 3 are not used. Each is its rms over the full disc: behind
  /// an obscuration the same wavefront has another rms, and terms are no longer independent.
  std::array<double, kLastZernike + 1> zernike_m{};
  double wavefront_rms_m = 0;  ///< of what else there is, of unknown shape

  /// The clear area over that of the full disc.
  [[nodiscard]] double open_share() const noexcept;
  /// Frequency on the detector times this is the frequency over a wavelength's cutoff.
  [[nodiscard]] double nu_m(double wavelength_m) const noexcept {
    return wavelength_m * focal_length_m / aperture_m;
  }
};

/// Throws ConfigError. The band is not read: it is the camera's 450 to 850 nm.
[[nodiscard]] LensSpec read_lens(const ConfigTable& table, const CameraGeometry& camera);

/// The wavefront's curvature W20, in metres of path at the rim, for a source at `range_m` seen
/// through a lens focused at `focus_range_m`; infinity is a distance like others.
/// f^2 (1/Z - 1/Zf) / (8 N^2) = D^2/8 (1/Z - 1/Zf): positive for what is nearer than the focus, as
/// a z4 or z11 > 0 is.
[[nodiscard]] double defocus_m(const LensSpec& lens, double range_m, double focus_range_m) noexcept;

/// A wavelength and its share of the photons.
struct BandLine {
  double wavelength_m;
  double share;
};
inline constexpr std::size_t kBandLines = 5;
/// Five Gauss-Legendre wavelengths of a band that is flat in photons.
[[nodiscard]] std::array<BandLine, kBandLines> band_lines(const LensSpec& lens) noexcept;

/// What a wavefront error of unknown shape leaves of the OTF at `nu` of the cutoff:
/// 1 - (w/.18)^2 (1 - 4 (nu - .5)^2), w = rms in waves, at most .18.
/// Source: Shannon 1997, The Art and Science of Optical Design, chapter 4 ("aberration transfer
/// factor"): a fit to the mean of many lenses.
[[nodiscard]] double shannon_factor(double rms_waves, double nu) noexcept;

}  // namespace engine
