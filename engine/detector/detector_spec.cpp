#include "engine/detector/detector_spec.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {

double DetectorSpec::electrons_per_irradiance(Duration exposure) const noexcept {
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / mean_wavelength_m;
  return pixel_pitch_m * pixel_pitch_m * seconds(exposure) * quantum_efficiency / photon_j;
}

double DetectorSpec::dark_mean_e(Duration exposure) const noexcept {
  return dark_e_s * seconds(exposure);
}

double DetectorSpec::noise_e(double mean_e) const noexcept {
  const double gain = gain_e_dn();
  return std::sqrt(mean_e + read_noise_e * read_noise_e + gain * gain / 12.0);
}

DetectorSpec read_detector(const ConfigTable& table, double pixel_pitch_m,
                           double mean_wavelength_m) {
  DetectorSpec spec;
  spec.quantum_efficiency = table.number("quantum_efficiency", between(1e-6, 1.0));
  spec.full_well_e = table.number("full_well_e", positive());
  spec.read_noise_e = table.number("read_noise_e", at_least(0.0));
  spec.dark_e_s = table.number("dark_e_s", at_least(0.0));
  spec.bits = static_cast<int>(table.integer("bits", between(8, 16)));
  spec.pedestal_dn = table.number_or("pedestal_dn", 0.0, between(0.0, 65535.0));
  spec.quantiser = table.choice_or<Quantiser>(
      "quantiser", "floor", {{"floor", Quantiser::kFloor}, {"round", Quantiser::kRound}});
  spec.pixel_pitch_m = pixel_pitch_m;
  spec.mean_wavelength_m = mean_wavelength_m;
  return spec;
}

}  // namespace engine
