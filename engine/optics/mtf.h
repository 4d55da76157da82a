#pragma once

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

}  // namespace engine
