#include <algorithm>
#include <cmath>
#include <span>

#include "engine/core/constants.h"
#include "tools/characterize/sensor_figures.h"

namespace characterize {
namespace {

struct Spread {
  double mean = 0;
  double rms = 0;
};

/// Over the pixels in use; of an empty map, what all are alike.
Spread spread_of(std::span<const float> map, const PixelMask& used, double alike) {
  if (map.empty()) return {alike, 0.0};
  double n = 0;
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double value = static_cast<double>(map[i]) * used[i];
    n += used[i];
    sum += value;
    squares += value * value;
  }
  const double mean = sum / n;
  return {mean, std::sqrt(std::max((squares - n * mean * mean) / (n - 1.0), 0.0))};
}

/// Of a normal distribution that ends at `end`.
double clipped_variance(double mean, double sigma, double end) {
  const double z = (end - mean) / sigma;
  // By the first two moments of y = max(end - x, 0).
  const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * engine::kPi);
  const double below = 0.5 * std::erfc(-z / std::sqrt(2.0));
  const double first = density + z * below;
  return sigma * sigma * ((1.0 + z * z) * below + z * density - first * first);
}

/// The light, in electrons of the mean pixel, at which the mean variance of all pixels is largest.
double peak_of_variance_e(const SensorTruth& truth, const engine::SensorMaps& maps,
                          const PixelMask& used, double end_e) {
  constexpr std::size_t kSample = 256;  // of the pixels
  constexpr int kSteps = 800;
  std::vector<double> response;
  const auto map = maps.response();
  for (std::size_t i = 0; i < map.size(); i += std::max<std::size_t>(1, map.size() / kSample))
    if (used[i] != 0) response.push_back(static_cast<double>(map[i]) / truth.mean_response);
  if (response.empty()) response.push_back(1.0);
  const double dark_e = truth.dark_rate_e_s * truth.exposure_s;
  double best_e = 0;
  double most = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double signal_e = end_e * (0.5 + 0.7 * i / kSteps);
    double variance = 0;
    for (const double r : response) {
      const double mean_e = signal_e * r + dark_e;
      variance += clipped_variance(
          mean_e, std::sqrt(mean_e + truth.spec.read_noise_e * truth.spec.read_noise_e), end_e);
    }
    if (variance <= most) continue;
    most = variance;
    best_e = signal_e;
  }
  return best_e;
}

}  // namespace

SensorTruth sensor_truth(const engine::DetectorSpec& spec, const engine::SensorMaps& maps,
                         const PixelMask& used, double exposure_s) {
  SensorTruth truth;
  truth.spec = spec;
  truth.exposure_s = exposure_s;
  const Spread response = spread_of(maps.response(), used, 1.0);
  truth.mean_response = response.mean;
  truth.prnu_rms = response.rms / response.mean;
  const Spread dark = spread_of(maps.dark_e_s(), used, spec.dark_mean_e(std::chrono::seconds(1)));
  truth.dark_rate_e_s = dark.mean;
  truth.dark_rate_rms_e_s = dark.rms;
  truth.offset_dn = spec.pedestal_dn - (spec.quantiser == engine::Quantiser::kFloor ? 0.5 : 0.0);
  // The full well, or the end of the converter, whichever comes first.
  const double end_e =
      std::min(spec.full_well_e, (spec.largest_dn() - truth.offset_dn) * spec.gain_e_dn());
  truth.largest_signal_e = end_e - dark.mean * exposure_s;
  truth.saturation_e = peak_of_variance_e(truth, maps, used, end_e);
  return truth;
}

}  // namespace characterize
