#pragma once

#include "engine/core/image.h"

namespace engine {

/// Something without a size on the detector.
struct PointSource {
  PixelPoint place;  ///< at mid-exposure
  /// At the pupil, across the line of sight. In watts of photons of the detector's mean wavelength:
  /// what of another colour sends as many photons in band counts as much.
  double irradiance_w_m2 = 0;
  /// Its own motion from shutter open to shutter close, of stars: light in the target's window
  /// smears by Radiance::motion_px instead.
  PixelPoint motion_px{};
};

}  // namespace engine
