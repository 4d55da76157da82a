#include "tools/characterize/sensor_figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace characterize {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLeastExposures = 6;

Quantity times(const Quantity& q, double factor) {
  return {q.value * factor, q.error * std::abs(factor)};
}

Quantity less(const Quantity& a, const Quantity& b) {
  return {a.value - b.value, std::hypot(a.error, b.error)};
}

Quantity decibel(const Quantity& q) {
  return {20.0 * std::log10(q.value), 20.0 / std::log(10.0) * q.error / q.value};
}

/// Why a stack of dark frames does not show their noise.
std::string why_not(const StackFigures& stack) {
  char text[160];
  if (stack.cut_off()) {
    std::snprintf(text, sizeof text,
                  "%.3g %% of the dark values are 0 DN: the pedestal cuts the noise off",
                  100.0 * stack.share_at_zero);
  } else {
    std::snprintf(text, sizeof text, "dark variance %.3g DN2 < %.2f: dominated by the quantiser",
                  stack.variance_dn2.value, kLeastVariance_dn2);
  }
  return text;
}

class Table {
 public:
  Table(const SensorRecord& record, const PhotonTransfer& transfer, const SensorTruth& truth)
      : record_(record), transfer_(transfer), truth_(truth), gain_(transfer.gain_dn_e()) {}

  std::vector<Figure> figures() {
    figures_.reserve(32);  // references to rows stay good
    add_transfer();
    add_saturation();
    add_noise();
    add_dark_current();
    add_patterns();
    add_range();
    return std::move(figures_);
  }

 private:
  Figure& add(std::string key, std::string name, std::string unit, const Quantity& measured,
              double truth) {
    figures_.push_back({.key = std::move(key),
                        .name = std::move(name),
                        .unit = std::move(unit),
                        .measured = measured,
                        .truth = truth,
                        .standing = Standing::kMeasured,
                        .note = {},
                        .of_variance = false});
    return figures_.back();
  }
  void not_measurable(Figure& figure, const std::string& why) {
    figure.measured = {kNone, kNone};
    figure.standing = Standing::kNotMeasurable;
    figure.note = why;
  }
  [[nodiscard]] double dark_e() const { return truth_.dark_rate_e_s * truth_.exposure_s; }
  [[nodiscard]] double read_variance_e2() const {
    return truth_.spec.read_noise_e * truth_.spec.read_noise_e;
  }

  void add_transfer() {
    const double gain = truth_.spec.gain_e_dn();
    const double efficiency = truth_.spec.quantum_efficiency * truth_.mean_response;
    add("gain_dn_e", "system gain K", "DN/e-", gain_, 1.0 / gain);
    add("gain_e_dn", "inverse of K", "e-/DN", transfer_.gain_e_dn(), gain);
    add("responsivity_dn_photon", "responsivity", "DN/photon", transfer_.response.slope,
        efficiency / gain);
    add("quantum_efficiency", "quantum efficiency", "%", times(transfer_.quantum_efficiency, 100.0),
        100.0 * efficiency);
    add("linearity_error", "linearity error LE", "%", times(transfer_.linearity_error, 100.0), 0.0)
        .note = "its error: what noise makes of a straight line";
  }

  void add_saturation() {
    Figure& peak = add("saturation_capacity_e", "saturation capacity", "e-", transfer_.saturation_e,
                       truth_.saturation_e);
    peak.note = "where the temporal variance is largest: the well cuts noise off before it is full";
    Figure& end = add("full_well_e", "full well: end of response", "e-",
                      ratio_of(less(record_.brightest_dn, transfer_.response.intercept), gain_),
                      truth_.largest_signal_e);
    if (truth_.largest_signal_e + dark_e() < truth_.spec.full_well_e)
      end.note = "the converter ends before the well is full";
    add("snr_max_db", "largest SNR", "dB", times(decibel(transfer_.saturation_e), 0.5),
        10.0 * std::log10(truth_.saturation_e));
  }

  void add_noise() {
    const StackFigures& bias = record_.dark.front();
    const StackFigures& dark = record_.dark_stack;
    Figure& offset = add("dark_offset_dn", "dark value, shortest exposure", "DN", bias.mean_dn,
                         truth_.offset_dn);
    if (!bias.shows_noise()) {
      offset.standing = bias.cut_off() ? Standing::kUpperLimit : Standing::kMeasured;
      offset.note = why_not(bias);
    }
    add_noise_figure("read_noise_e", "read noise", bias, std::sqrt(read_variance_e2()));
    add_noise_figure("dark_noise_e", "temporal dark noise", dark,
                     std::sqrt(read_variance_e2() + dark_e()));
  }

  /// Of what the quantiser hides, the most that it can hide.
  void add_noise_figure(const std::string& key, const std::string& name, const StackFigures& stack,
                        double truth) {
    Figure& figure = add(key, name, "e-", noise_e(stack.variance_dn2, gain_), truth);
    if (stack.shows_noise()) return;
    if (stack.cut_off()) {
      not_measurable(figure, why_not(stack));
      return;
    }
    figure.measured = noise_e({kLeastVariance_dn2, stack.variance_dn2.error}, gain_);
    figure.standing = Standing::kUpperLimit;
    figure.note = why_not(stack);
  }

  void add_dark_current() {
    std::vector<double> exposure_s;
    std::vector<double> mean;
    std::vector<double> mean_error;
    std::vector<double> variance;
    std::vector<double> variance_error;
    for (const StackFigures& level : record_.dark) {
      if (!level.shows_noise()) continue;
      exposure_s.push_back(level.exposure_s);
      mean.push_back(level.mean_dn.value);
      mean_error.push_back(level.mean_dn.error);
      variance.push_back(level.variance_dn2.value);
      variance_error.push_back(level.variance_dn2.error);
    }
    Figure& by_mean =
        add("dark_current_e_s", "dark current, by mean", "e-/s", {}, truth_.dark_rate_e_s);
    if (exposure_s.size() < kLeastExposures) {
      const std::string why = "too few exposures show dark noise: " + why_not(record_.dark.front());
      not_measurable(by_mean, why);
      not_measurable(add("dark_current_by_variance_e_s", "dark current, by variance", "e-/s", {},
                         truth_.dark_rate_e_s),
                     why);
      return;
    }
    char range[100];
    std::snprintf(range, sizeof range, "from %zu exposures, %.3g to %.3g s", exposure_s.size(),
                  exposure_s.front(), exposure_s.back());
    by_mean.measured = ratio_of(fit_line(exposure_s, mean, mean_error).slope, gain_);
    by_mean.note = range;
    const Quantity slope = ratio_of(fit_line(exposure_s, variance, variance_error).slope, gain_);
    add("dark_current_by_variance_e_s", "dark current, by variance", "e-/s", ratio_of(slope, gain_),
        truth_.dark_rate_e_s);
  }

  void add_patterns() {
    const StackFigures& dark = record_.dark_stack;
    const StackFigures& half = record_.half_stack;
    const StackFigures& longest = record_.long_dark_stack;
    const Quantity signal = less(half.mean_dn, dark.mean_dn);
    const Quantity pattern = less(half.spatial_variance_dn2, dark.spatial_variance_dn2);
    add("prnu_1288", "PRNU1288", "%", times(ratio_of(root_of(pattern), signal), 100.0),
        100.0 * truth_.prnu_rms)
        .of_variance = true;
    Figure& dsnu =
        add("dsnu_1288_e", "DSNU1288", "e-", ratio_of(root_of(dark.spatial_variance_dn2), gain_),
            truth_.dark_rate_rms_e_s * truth_.exposure_s);
    dsnu.of_variance = true;
    if (!dark.shows_noise()) not_measurable(dsnu, why_not(dark));
    char range[60];
    std::snprintf(range, sizeof range, "at %.3g s", longest.exposure_s);
    Figure& current =
        add("dark_current_rms_e_s", "dark current, pixel to pixel", "e-/s",
            times(ratio_of(root_of(longest.spatial_variance_dn2), gain_), 1.0 / longest.exposure_s),
            truth_.dark_rate_rms_e_s);
    current.note = range;
    current.of_variance = true;
    if (!longest.shows_noise()) not_measurable(current, why_not(longest));
  }

  void add_range() {
    // EMVA 1288's own way with a variance that the quantiser hides: the limit stands for it.
    const StackFigures& dark = record_.dark_stack;
    Quantity variance = dark.variance_dn2;
    variance.value = std::max(variance.value, kLeastVariance_dn2);
    const Quantity threshold = sensitivity_threshold(variance, gain_, transfer_.quantum_efficiency);
    const double gain = truth_.spec.gain_e_dn();
    const double efficiency = truth_.spec.quantum_efficiency * truth_.mean_response;
    const double dark_variance_e2 =
        read_variance_e2() + dark_e() + gain * gain * kQuantisingVariance_dn2;
    const double true_threshold = (std::sqrt(dark_variance_e2 + 0.25) + 0.5) / efficiency;
    Figure& least = add("sensitivity_threshold_photons", "absolute sensitivity threshold",
                        "photons", threshold, true_threshold);
    Figure& range = add("dynamic_range_db", "dynamic range", "dB",
                        decibel(ratio_of(transfer_.saturation_photons, threshold)),
                        20.0 * std::log10(truth_.saturation_e / efficiency / true_threshold));
    if (dark.shows_noise()) return;
    if (dark.cut_off()) {
      not_measurable(least, why_not(dark));
      not_measurable(range, why_not(dark));
      return;
    }
    least.standing = Standing::kUpperLimit;
    least.note = why_not(dark);
    range.standing = Standing::kLowerLimit;
  }

  const SensorRecord& record_;
  const PhotonTransfer& transfer_;
  const SensorTruth& truth_;
  Quantity gain_;
  std::vector<Figure> figures_;
};

}  // namespace

std::vector<Figure> sensor_figures(const SensorRecord& record, const PhotonTransfer& transfer,
                                   const SensorTruth& truth) {
  return Table(record, transfer, truth).figures();
}

}  // namespace characterize
