#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/optics/lens.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

/// What the lens is focused at.
enum class Focus : std::uint8_t { kTarget, kInfinity, kDistance };

/// A sinusoid of the boresight, of many periods to an exposure: one of few is a path.
struct VibrationSpec {
  static constexpr double kFewPeriods = 3;
  double amplitude_rad = 0;
  double direction_rad = 0;  ///< from u towards v
  double frequency_hz = 0;   ///< 0: not known, many periods
};

/// A measured MTF of what the other terms do not say, by frequency on the detector: a broken line.
struct MtfTable {
  std::vector<double> per_m;  ///< rising, the first 0
  std::vector<double> value;  ///< in [-1, 1], the first 1

  /// The last value beyond the last frequency; 1 for an empty table.
  [[nodiscard]] double at(double frequency_per_m) const noexcept;
};
/// Two columns with a header line, frequency_lp_mm and mtf. Throws std::runtime_error.
[[nodiscard]] MtfTable read_mtf_table(const std::string& path);

/// What of an even field's light reaches a place of the detector, of that at the principal point:
/// 1 + r2 s^2 + r4 s^4 + r6 s^6, s = 1 at the sensor's corners, times cos^4 of the angle where that
/// is asked for.
struct VignettingSpec {
  double r2 = 0, r4 = 0, r6 = 0;
  bool cos4 = false;

  [[nodiscard]] bool none() const noexcept { return r2 == 0.0 && r4 == 0.0 && r6 == 0.0 && !cos4; }
  [[nodiscard]] double polynomial(double s2) const noexcept {
    return 1.0 + s2 * (r2 + s2 * (r4 + s2 * r6));
  }
};

struct OpticsSpec {
  LensSpec lens;
  double transmission = 0.7;  ///< in (0, 1]
  Focus focus = Focus::kTarget;
  double focus_range_m = std::numeric_limits<double>::infinity();  ///< unless it is the target
  double jitter_rad = 0;  ///< rms of the boresight along each axis, quick and random
  VibrationSpec vibration;
  MtfTable mtf;
  bool stars = false;  ///< there are some, and out of focus where the target is in it
  VignettingSpec vignetting;
  double veiling_glare = 0;   ///< share of all light on the detector that is spread evenly over it
  int oversampling = 3;       ///< cells on a pixel's side; 1: the paper's grid
  int largest_wing_px = 256;  ///< light spread further than this is lost, and the loss reported
  CameraGeometry camera;

  /// W20 of a source, the target at `target_range_m`; infinity for stars.
  [[nodiscard]] double defocus_m(double range_m, double target_range_m) const noexcept;
};
[[nodiscard]] OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera);

/// Irradiance on the detector for a radiance that is even over the field, in its unit per sr.
[[nodiscard]] double throughput_sr(const OpticsSpec& spec) noexcept;

/// Between the centres of the longest and the shortest wave of the band.
[[nodiscard]] inline double middle_wavelength_m(const OpticsSpec& spec) noexcept {
  return 0.5 * (spec.lens.band_low_m + spec.lens.band_high_m);
}

}  // namespace engine
