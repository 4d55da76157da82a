#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "engine/detector/sensor_maps.h"
#include "tools/characterize/photon_transfer.h"
#include "tools/characterize/sensor_record.h"

namespace characterize {

/// What a measured figure is worth.
enum class Standing : std::uint8_t {
  kMeasured,
  kUpperLimit,  ///< the truth is less
  kLowerLimit,  ///< the truth is more
  kNotMeasurable
};

/// A line of the report.
struct Figure {
  std::string key;   ///< "gain_dn_e"
  std::string name;  ///< "system gain"
  std::string unit;
  Quantity measured;
  double truth = 0;  ///< what the scenario says
  Standing standing = Standing::kMeasured;
  std::string note;

  bool of_variance = false;  ///< the root of a variance, which may have been about 0

  /// Of a measured one: by how many standard errors it is off.
  [[nodiscard]] double sigmas() const noexcept {
    const double value = measured.value;
    const double error = measured.error;
    if (!of_variance) return (value - truth) / error;
    return (value * value - truth * truth) / std::max(2.0 * value * error, error * error);
  }
};

/// What a sensor is like, over the pixels that are no defects: what the measurement should find.
struct SensorTruth {
  engine::DetectorSpec spec;
  double exposure_s = 0;
  double mean_response = 1;
  double prnu_rms = 0;
  double dark_rate_e_s = 0;  ///< background included
  double dark_rate_rms_e_s = 0;
  double saturation_e = 0;      ///< EMVA's: where clipping begins to take from the variance
  double largest_signal_e = 0;  ///< where the response ends
  double offset_dn = 0;         ///< of the mean, without a signal
};
[[nodiscard]] SensorTruth sensor_truth(const engine::DetectorSpec& spec,
                                       const engine::SensorMaps& maps, const PixelMask& used,
                                       double exposure_s);

/// The table of EMVA 1288's figures.
[[nodiscard]] std::vector<Figure> sensor_figures(const SensorRecord& record,
                                                 const PhotonTransfer& transfer,
                                                 const SensorTruth& truth);

}  // namespace characterize
