#include "engine/detector/pixel_budget.h"

#include <algorithm>
#include <cmath>

namespace engine {

PixelBudget pixel_budget(double irradiance_w_m2, Duration exposure, double throughput_sr,
                         const DetectorSpec& spec) noexcept {
  PixelBudget b;
  b.irradiance_w_m2 = irradiance_w_m2;
  b.radiance_w_m2_sr = irradiance_w_m2 / throughput_sr;
  b.light_e = irradiance_w_m2 * spec.electrons_per_irradiance(exposure);
  b.photons = b.light_e / spec.quantum_efficiency;
  b.dark_e = spec.dark_mean_e(exposure);
  const double dn =
      std::min(b.light_e + b.dark_e, spec.full_well_e) / spec.gain_e_dn() + spec.pedestal_dn;
  b.clipped = b.light_e + b.dark_e > spec.full_well_e || dn > spec.largest_dn();
  b.mean_dn = std::min(dn, 1.0 * spec.largest_dn());

  PixelBudget::Noise& n = b.noise;
  n.photon_e = std::sqrt(b.light_e);
  n.dark_e = std::sqrt(b.dark_e);
  n.read_e = spec.read_noise_e;
  n.quantiser_e = spec.gain_e_dn() / std::sqrt(12.0);
  // A pixel's photosites differ independently.
  n.prnu_e = spec.prnu_rms / spec.binning * b.light_e;
  n.dsnu_e = spec.dsnu_rms / spec.binning * spec.dark_rate_e_s() * seconds(exposure);
  n.temporal_e = std::hypot(std::hypot(n.photon_e, n.dark_e), std::hypot(n.read_e, n.quantiser_e));
  n.total_e = std::hypot(n.temporal_e, n.prnu_e, n.dsnu_e);
  return b;
}

}  // namespace engine
