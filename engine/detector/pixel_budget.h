#pragma once

#include "engine/detector/detector_spec.h"

namespace engine {

/// One pixel from light to numbers, and the causes of its noise: figure 7 of Li et al. 2023.
struct PixelBudget {
  double radiance_w_m2_sr = 0;  ///< an even field's that would light it as much
  double irradiance_w_m2 = 0;   ///< on the detector, mean over the pixel
  double photons = 0;           ///< of the band's mean energy, over the exposure
  double light_e = 0;           ///< mean of what they free
  double dark_e = 0;            ///< mean of dark current and background
  double mean_dn = 0;           ///< before the quantiser, within what the ADC has
  bool clipped = false;         ///< the mean is over the full well or the ADC's end

  /// rms, in electrons, before anything is clipped. The patterns are the same in every frame.
  struct Noise {
    double photon_e = 0;
    double dark_e = 0;  ///< shot noise of dark_e
    double read_e = 0;
    double quantiser_e = 0;  ///< of an even step: 1 / sqrt(12) DN
    double prnu_e = 0;       ///< pattern of the response; what a map of the user's has is not in it
    double dsnu_e = 0;       ///< pattern of the dark current; as above
    double temporal_e = 0;   ///< all but the patterns
    double total_e = 0;
  } noise;
};

/// Pre: exposure > 0, throughput > 0.
[[nodiscard]] PixelBudget pixel_budget(double irradiance_w_m2, Duration exposure,
                                       double throughput_sr, const DetectorSpec& spec) noexcept;

}  // namespace engine
