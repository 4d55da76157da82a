#pragma once

#include <vector>

namespace engine {

/// Transfer functions of the image. Frequencies in cycles per pixel or per metre as named; all are
/// 1 at zero frequency. They are OTFs, with their sign: |J0| for J0 makes negative light.

/// Incoherent diffraction of a circular pupil with a central obscuration, in focus and free of
/// aberration. `nu` is the frequency over the cutoff D/(lambda f); 0 from 1 on.
/// Source: O'Neill 1956, DOI 10.1364/JOSA.46.000285. `obscuration`: diameter ratio in [0, 1).
[[nodiscard]] double diffraction_otf(double nu, double obscuration) noexcept;

/// sin(pi x) / (pi x).
[[nodiscard]] double sinc(double x) noexcept;

/// A square pixel, or a linear smear over an exposure: sinc of frequency times length.
[[nodiscard]] inline double box_otf(double frequency, double length) noexcept {
  return sinc(frequency * length);
}

/// Vibration by whole periods per exposure, eq 18 of Li et al. 2023: J0(2 pi A f), signed.
[[nodiscard]] double vibration_otf(double frequency, double amplitude) noexcept;

/// Random jitter of this rms along one axis.
[[nodiscard]] double jitter_otf(double frequency, double rms) noexcept;

/// Diffraction over a band that is flat in photons, tabulated by frequency in cycles per metre.
/// Five Gauss-Legendre wavelengths: within 1e-3 of 41.
class BandOtf {
 public:
  struct Spec {
    double focal_length_m = 4.5;
    double aperture_m = 0.36;
    double obscuration = 0;  ///< diameter ratio
    double band_low_m = 450e-9;
    double band_high_m = 850e-9;
  };
  explicit BandOtf(const Spec& spec);

  [[nodiscard]] double cutoff_per_m() const noexcept { return cutoff_per_m_; }
  [[nodiscard]] double at(double frequency_per_m) const noexcept;

 private:
  double cutoff_per_m_;
  std::vector<float> table_;
};

}  // namespace engine
