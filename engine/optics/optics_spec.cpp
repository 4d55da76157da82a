#include "engine/optics/optics_spec.h"

#include <string>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kSmallestWing_px = 8;

}  // namespace

OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera) {
  OpticsSpec spec;
  spec.camera = camera;
  spec.band.focal_length_m = camera.focal_length_m;
  spec.band.aperture_m = table.number("aperture_m", positive());
  spec.band.obscuration = table.number_or("obscuration", 0.0, from_below(0.0, 1.0));
  spec.transmission = table.number("transmission", between(1e-6, 1.0));
  spec.largest_wing_px =
      static_cast<int>(table.integer_or("largest_wing_px", 256, between(kSmallestWing_px, 512)));
  const double cells_per_m = 3.0 / camera.pixel_pitch_m;
  const double cutoff_per_m = spec.band.aperture_m / (camera.focal_length_m * spec.band.band_low_m);
  if (cutoff_per_m > 0.5 * cells_per_m) {
    table.fail("aperture_m", "passes " + std::to_string(cutoff_per_m * 1e-3) +
                                 " lp/mm, more than the " + std::to_string(0.5e-3 * cells_per_m) +
                                 " that three cells to a pixel can carry");
  }
  return spec;
}

double throughput_sr(const OpticsSpec& spec) noexcept {
  const double d_over_f = spec.band.aperture_m / spec.band.focal_length_m;
  const double open = 1.0 - spec.band.obscuration * spec.band.obscuration;
  return kPi / 4.0 * d_over_f * d_over_f * spec.transmission * open;
}

}  // namespace engine
