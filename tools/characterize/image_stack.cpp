#include "tools/characterize/image_stack.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "engine/core/contract.h"

namespace characterize {
namespace {

double median_of(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

}  // namespace

ImageStack::ImageStack(PixelMask mask)
    : mask_(std::move(mask)),
      used_(static_cast<std::size_t>(std::accumulate(mask_.begin(), mask_.end(), 0L))),
      sum_(mask_.size()),
      first_(mask_.size()) {
  ENSURE(used_ >= 2);
}

void ImageStack::add(const engine::DnImage& frame) {
  const auto dn = frame.pixels();
  ENSURE(dn.size() == mask_.size());
  std::uint64_t zeros = 0;
  for (std::size_t i = 0; i < dn.size(); ++i) {
    sum_[i] += dn[i];
    zeros += static_cast<std::uint64_t>(mask_[i] & static_cast<std::uint8_t>(dn[i] == 0));
  }
  zeros_ += zeros;
  if (++frames_ % 2 == 1) {
    std::ranges::copy(dn, first_.begin());
    return;
  }
  std::int64_t sum = 0;
  std::int64_t squares = 0;
  for (std::size_t i = 0; i < dn.size(); ++i) {
    const std::int64_t d = (std::int64_t{dn[i]} - first_[i]) * mask_[i];
    sum += d;
    squares += d * d;
  }
  const auto n = static_cast<double>(used_);
  const double mean = static_cast<double>(sum) / n;
  difference_variances_ += (static_cast<double>(squares) - n * mean * mean) / (n - 1.0);
}

Quantity ImageStack::mean_dn() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < sum_.size(); ++i) sum += std::uint64_t{sum_[i]} * mask_[i];
  const double values = static_cast<double>(used_) * frames_;
  return {static_cast<double>(sum) / values, std::sqrt(temporal_variance_dn2().value / values)};
}

Quantity ImageStack::temporal_variance_dn2() const {
  ENSURE(frames_ >= 2);
  const int pairs = frames_ / 2;
  const double variance = 0.5 * difference_variances_ / pairs;
  return {variance, variance * std::sqrt(2.0 / (static_cast<double>(used_) * pairs))};
}

Quantity ImageStack::spatial_variance_dn2() const {
  const double mean = mean_dn().value * frames_;
  double squares = 0;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    const double d = (static_cast<double>(sum_[i]) - mean) * mask_[i];
    squares += d * d;
  }
  const auto n = static_cast<double>(used_);
  const Quantity temporal = temporal_variance_dn2();
  const double rest = temporal.value / frames_;
  const double pattern = squares / (n - 1.0) / (1.0 * frames_ * frames_) - rest;
  return {pattern, std::hypot(std::sqrt((4.0 * std::max(pattern, 0.0) + 2.0 * rest) * rest / n),
                              temporal.error / frames_)};
}

double ImageStack::share_at_zero() const noexcept {
  return static_cast<double>(zeros_) / (static_cast<double>(used_) * frames_);
}

std::vector<float> ImageStack::mean_image_dn() const {
  std::vector<float> mean(sum_.size());
  for (std::size_t i = 0; i < sum_.size(); ++i)
    mean[i] = static_cast<float>(static_cast<double>(sum_[i]) / frames_);
  return mean;
}

std::vector<std::size_t> outliers(std::span<const float> mean_dn, double sigmas,
                                  double least_sigma_dn) {
  constexpr double kSigmaOfMad = 1.4826;  // of a normal distribution
  const double median = median_of({mean_dn.begin(), mean_dn.end()});
  std::vector<float> off(mean_dn.size());
  for (std::size_t i = 0; i < off.size(); ++i)
    off[i] = static_cast<float>(std::abs(static_cast<double>(mean_dn[i]) - median));
  const double limit = sigmas * std::max(kSigmaOfMad * median_of(off), least_sigma_dn);
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < off.size(); ++i)
    if (static_cast<double>(off[i]) > limit) far.push_back(i);
  return far;
}

}  // namespace characterize
