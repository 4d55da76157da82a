#include "tools/characterize/photon_transfer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "engine/core/constants.h"

namespace characterize {
namespace {

constexpr std::size_t kLeastLevels = 5;  // in a line

/// What a fit sees of the levels.
struct Columns {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> sigma;
  void add(double x_here, const Quantity& y_here) {
    x.push_back(x_here);
    y.push_back(y_here.value);
    sigma.push_back(std::max(y_here.error, 1e-12));
  }
  [[nodiscard]] Line fit() const { return fit_line(x, y, sigma); }
};

/// The signal at saturation's share of each level.
double share_of(const std::vector<LightLevel>& levels, std::size_t i, std::size_t saturation) {
  const double dark_dn = levels.front().mean_dn.value;
  return (levels[i].mean_dn.value - dark_dn) / (levels[saturation].mean_dn.value - dark_dn);
}

std::vector<std::size_t> between(const std::vector<LightLevel>& levels, std::size_t saturation,
                                 double from, double to) {
  std::vector<std::size_t> inside;
  for (std::size_t i = 1; i < saturation; ++i) {
    const double share = share_of(levels, i, saturation);
    if (share >= from && share <= to) inside.push_back(i);
  }
  if (inside.size() < kLeastLevels)
    throw std::runtime_error("photon transfer: only " + std::to_string(inside.size()) +
                             " levels of light between dark and saturation");
  return inside;
}

/// A variance's own error goes by the line, not by chance: weights that follow the scatter of what
/// they weigh would pull the line down.
Line fit_transfer(const std::vector<LightLevel>& levels, const std::vector<std::size_t>& use) {
  Columns columns;
  for (const std::size_t i : use)
    if (levels[i].variance_dn2.value >= kEvenVariance_dn2)
      columns.add(levels[i].mean_dn.value, levels[i].variance_dn2);
  if (columns.x.size() < kLeastLevels)
    throw std::runtime_error("photon transfer: the quantiser hides the noise of light");
  const Line first = columns.fit();
  for (std::size_t k = 0; k < columns.x.size(); ++k)
    columns.sigma[k] *= std::max(first.at(columns.x[k]) / columns.y[k], 1e-3);
  return columns.fit();
}

/// How far light may be off before its variance is told from the peak's.
double saturation_error_photons(const std::vector<LightLevel>& levels, std::size_t peak) {
  const Quantity& most = levels[peak].variance_dn2;
  std::size_t low = peak;
  std::size_t high = peak;
  const auto as_high = [&](std::size_t i) {
    return levels[i].variance_dn2.value >= most.value - 2.0 * std::sqrt(2.0) * most.error;
  };
  while (low > 0 && as_high(low - 1)) --low;
  while (high + 1 < levels.size() && as_high(high + 1)) ++high;
  const double step = levels[std::min(peak + 1, levels.size() - 1)].photons -
                      levels[peak > 0 ? peak - 1 : 0].photons;
  return std::max(0.5 * (levels[high].photons - levels[low].photons), 0.5 * step) / std::sqrt(3.0);
}

void judge_linearity(const std::vector<LightLevel>& levels, PhotonTransfer& out) {
  const auto use =
      between(levels, out.saturation, PhotonTransfer::kFitFrom, PhotonTransfer::kLinearTo);
  const double dark_dn = levels.front().mean_dn.value;
  Columns columns;
  for (const std::size_t i : use) {
    const double signal = levels[i].mean_dn.value - dark_dn;
    columns.add(levels[i].irradiance_w_m2, {signal, signal});
  }
  const Line line = columns.fit();
  out.deviation.assign(levels.size(), std::numeric_limits<double>::quiet_NaN());
  const auto count = static_cast<double>(use.size());
  for (std::size_t k = 0; k < use.size(); ++k) {
    const double fitted = line.at(columns.x[k]);
    const double deviation = (columns.y[k] - fitted) / fitted;
    out.deviation[use[k]] = deviation;
    out.linearity_error.value += std::abs(deviation) / count;
    // What noise alone would make of a straight line.
    out.linearity_error.error +=
        std::sqrt(2.0 / engine::kPi) * levels[use[k]].mean_dn.error / fitted / count;
  }
}

}  // namespace

PhotonTransfer photon_transfer(const std::vector<LightLevel>& levels) {
  if (levels.size() < kLeastLevels + 2)
    throw std::runtime_error("photon transfer: too few levels of light");
  PhotonTransfer out;
  const auto peak = std::ranges::max_element(
      levels, {}, [](const LightLevel& level) { return level.variance_dn2.value; });
  out.saturation = static_cast<std::size_t>(peak - levels.begin());
  if (out.saturation + 1 == levels.size())
    throw std::runtime_error("photon transfer: the brightest light does not saturate the sensor");
  if (!(peak->mean_dn.value > levels.front().mean_dn.value))
    throw std::runtime_error("photon transfer: light makes no signal");

  const auto use =
      between(levels, out.saturation, PhotonTransfer::kFitFrom, PhotonTransfer::kFitTo);
  out.transfer = fit_transfer(levels, use);
  Columns response;
  for (const std::size_t i : use) response.add(levels[i].photons, levels[i].mean_dn);
  out.response = response.fit();
  out.quantum_efficiency = ratio_of(out.response.slope, out.gain_dn_e());
  out.saturation_photons = {peak->photons, saturation_error_photons(levels, out.saturation)};
  const double saturation_e = out.quantum_efficiency.value * peak->photons;
  out.saturation_e = {saturation_e,
                      std::hypot(out.quantum_efficiency.error * peak->photons,
                                 out.quantum_efficiency.value * out.saturation_photons.error)};
  judge_linearity(levels, out);
  return out;
}

Quantity noise_e(const Quantity& variance_dn2, const Quantity& gain_dn_e) noexcept {
  return ratio_of(root_of({variance_dn2.value - kQuantisingVariance_dn2, variance_dn2.error}),
                  gain_dn_e);
}

Quantity sensitivity_threshold(const Quantity& dark_variance_dn2, const Quantity& gain_dn_e,
                               const Quantity& quantum_efficiency) noexcept {
  const Quantity noise = ratio_of(root_of(dark_variance_dn2), gain_dn_e);
  const double root = std::sqrt(noise.value * noise.value + 0.25);
  return ratio_of({root + 0.5, noise.value / root * noise.error}, quantum_efficiency);
}

}  // namespace characterize
