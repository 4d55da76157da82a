#pragma once

#include "engine/core/config_reader.h"
#include "engine/optics/mtf.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

struct OpticsSpec {
  BandOtf::Spec band;
  double transmission = 0.7;  ///< in (0, 1]
  int largest_wing_px = 256;  ///< light spread further than this is lost, and the loss reported
  CameraGeometry camera;
};
[[nodiscard]] OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera);

/// Irradiance on the detector for a radiance that is even over the field, in its unit per sr.
[[nodiscard]] double throughput_sr(const OpticsSpec& spec) noexcept;

/// Between the centres of the longest and the shortest wave of the band.
[[nodiscard]] inline double middle_wavelength_m(const OpticsSpec& spec) noexcept {
  return 0.5 * (spec.band.band_low_m + spec.band.band_high_m);
}

}  // namespace engine
