#pragma once

#include <array>

namespace engine {

/// What a star's magnitude is worth to the camera: V and B-V to irradiance in the band.
///
/// A black body of the colour's temperature (Ballesteros 2012, EPL 97, 34008, eq 14), scaled so
/// that its mean flux in V (passband of Bessell 1990, PASP 102, 1181) is 3.631e-11 W/m^2/nm at V =
/// 0 (Bessell, Castelli & Plez 1998, A&A 333, 231). Photons of 450-850 nm are counted and given as
/// watts of photons of the detector's mean wavelength, as PointSource says.
/// Against real spectra: the Sun 0.3 % too faint; Vega 9 % too bright, since hot stars are no black
/// bodies beyond the Balmer jump. Leaves out: reddening apart from what B-V shows, variability.
class StarLight {
 public:
  explicit StarLight(double detector_mean_wavelength_m);

  /// B-V outside -0.5..6 counts as the nearest of these.
  [[nodiscard]] double irradiance_w_m2(double v_magnitude, double colour_b_v) const noexcept;

 private:
  static constexpr int kSteps = 325;  // of .02 in B-V; between them linear, within 2e-5
  std::array<double, kSteps + 1> at_zero_w_m2_{};
};

/// Of the black body that has this B-V.
[[nodiscard]] double colour_temperature_k(double colour_b_v) noexcept;

/// In band, of a star of V = 0: in watts, and photons a second, to a square metre.
struct BandLight {
  double irradiance_w_m2 = 0;
  double photons_m2_s = 0;
};
[[nodiscard]] BandLight band_light_at_zero(double colour_b_v) noexcept;

}  // namespace engine
