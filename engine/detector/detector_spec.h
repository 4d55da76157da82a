#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/time.h"

namespace engine {

enum class Quantiser : std::uint8_t { kFloor, kRound };

/// What a detector is like: table [detector] of a scenario.
struct DetectorSpec {
  double quantum_efficiency = 0.55;  ///< in (0, 1], mean over the band
  double full_well_e = 30000;
  double read_noise_e = 2;  ///< rms, per read
  double dark_e_s = 35;
  int bits = 11;
  double pedestal_dn = 0;
  Quantiser quantiser = Quantiser::kFloor;
  double pixel_pitch_m = 6.5e-6;
  double mean_wavelength_m = 626.78e-9;  ///< energy-weighted: sets the energy of a photon

  [[nodiscard]] double gain_e_dn() const noexcept { return full_well_e / (1 << bits); }
  [[nodiscard]] int largest_dn() const noexcept { return (1 << bits) - 1; }
  /// Electrons for 1 W/m^2 on a pixel over `exposure`.
  [[nodiscard]] double electrons_per_irradiance(Duration exposure) const noexcept;
  /// What an average pixel collects over `exposure` without light.
  [[nodiscard]] double dark_mean_e(Duration exposure) const noexcept;
  /// rms in electrons, of a pixel that collects `mean_e` in all.
  [[nodiscard]] double noise_e(double mean_e) const noexcept;
};
[[nodiscard]] DetectorSpec read_detector(const ConfigTable& table, double pixel_pitch_m,
                                         double mean_wavelength_m);

}  // namespace engine
