#include "engine/render/noise_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"

namespace engine {
namespace {

std::size_t area(const PixelRect& region) noexcept {
  return region.empty()
             ? 0
             : static_cast<std::size_t>(region.width()) * static_cast<std::size_t>(region.height());
}

/// Below this the spread of light stays within a pixel.
constexpr double kNoBlur_px = 0.05;
// Over which a pilot's variances are averaged: some ten pixels.
constexpr double kNeighbours_px = 1.0;

}  // namespace

NoiseMap::Kernel::Kernel(double rms_px) {
  weight.push_back(1.0F);
  if (rms_px < kNoBlur_px) return;
  const auto below = [&](double x) { return 0.5 * std::erfc(-x / (rms_px * std::sqrt(2.0))); };
  const int reach = std::min(kReach, static_cast<int>(std::ceil(5.0 * rms_px)));
  weight.clear();
  for (int i = 0; i <= reach; ++i)
    weight.push_back(static_cast<float>(below(i + 0.5) - below(i - 0.5)));
}

NoiseMap::NoiseMap(const PixelRect& largest, const SensorNoise& noise)
    : noise_(noise),
      light_(noise.blur_px),
      noise_kernel_(noise.blur_px / std::sqrt(2.0)),
      squares_(noise.blur_px < kNoBlur_px
                   ? 1.0
                   : std::min(1.0, 1.0 / (4.0 * kPi * noise.blur_px * noise.blur_px))),
      neighbours_(kNeighbours_px),
      signal_(area(largest)),
      weight_(area(largest)),
      work_(area(largest)),
      lines_(area(largest)) {}

void NoiseMap::spread(const Kernel& kernel, const PixelRect& region, const Map& in,
                      Map& out) noexcept {
  const int width = region.width();
  const int height = region.height();
  const int reach = static_cast<int>(kernel.weight.size()) - 1;
  const auto row = [&](int v) { return static_cast<std::ptrdiff_t>(v) * width; };
  std::fill_n(lines_.begin(), area(region), 0.0F);
  for (int v = 0; v < height; ++v) {
    for (int shift = -reach; shift <= reach; ++shift) {
      const float weight = kernel.weight[static_cast<std::size_t>(std::abs(shift))];
      const float* from = in.data() + row(v);
      float* to = lines_.data() + row(v);
      for (int u = std::max(0, -shift); u < std::min(width, width - shift); ++u)
        to[u] += weight * from[u + shift];
    }
  }
  std::fill_n(out.begin(), area(region), 0.0F);
  for (int v = 0; v < height; ++v) {
    for (int i = std::max(0, v - reach); i <= std::min(height - 1, v + reach); ++i) {
      const float weight = kernel.weight[static_cast<std::size_t>(std::abs(i - v))];
      const float* from = lines_.data() + row(i);
      float* to = out.data() + row(v);
      for (int u = 0; u < width; ++u) to[u] += weight * from[u];
    }
  }
}

NoiseReached NoiseMap::judge(const PixelRect& region, std::span<const float> mean) noexcept {
  const std::size_t pixels = area(region);
  ENSURE(pixels <= signal_.size() && mean.size() >= pixels);
  NoiseReached reached;
  for (std::size_t i = 0; i < pixels; ++i)
    signal_[i] = mean[i] * static_cast<float>(noise_.e_per_radiance);
  spread(light_, region, signal_, signal_);
  const double dark_e = noise_.sigma_e(0.0);
  for (std::size_t i = 0; i < pixels; ++i) {
    weight_[i] = 0.0F;
    const auto signal_e = static_cast<double>(signal_[i]);
    if (!(signal_e > dark_e)) continue;
    if (signal_e >= noise_.full_well_e) {
      ++reached.clipped_px;
      continue;
    }
    ++reached.lit_px;
    const double sigma = noise_.sigma_e(signal_e);
    weight_[i] = static_cast<float>(1.0 / (sigma * sigma));
  }
  return reached;
}

NoiseReached NoiseMap::measure(const PixelRect& region, std::span<const float> mean,
                               std::span<const float> variance) noexcept {
  NoiseReached reached;
  reached.rms = reached.worst = std::numeric_limits<double>::quiet_NaN();
  if (!(noise_.e_per_radiance > 0.0)) return reached;
  reached = judge(region, mean);
  const std::size_t pixels = area(region);
  const double to_e2 = noise_.e_per_radiance * noise_.e_per_radiance * squares_;
  for (std::size_t i = 0; i < pixels; ++i) work_[i] = variance[i] * static_cast<float>(to_e2);
  spread(noise_kernel_, region, work_, work_);
  double sum = 0;
  double worst = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto rho2 = static_cast<double>(work_[i] * weight_[i]);
    sum += rho2;
    worst = std::max(worst, rho2);
    reached.firefly_px += rho2 >= NoiseReached::kFirefly * NoiseReached::kFirefly ? 1 : 0;
  }
  reached.rms = reached.lit_px > 0 ? std::sqrt(sum / reached.lit_px) : 0.0;
  reached.worst = std::sqrt(worst);
  return reached;
}

void NoiseMap::plan(const Plan& wish, const PixelRect& region, std::span<const float> mean,
                    std::span<const float> variance_of_one,
                    std::span<std::uint32_t> samples) noexcept {
  const std::size_t pixels = area(region);
  const auto least = static_cast<std::uint32_t>(wish.least);
  ENSURE(samples.size() >= pixels);
  std::fill_n(samples.begin(), pixels, least);
  if (!(noise_.e_per_radiance > 0.0)) return;
  const NoiseReached lit = judge(region, mean);
  if (lit.lit_px == 0) return;
  // What a pixel's variance adds to the sum of squares over all lit pixels.
  const double to_e2 = noise_.e_per_radiance * noise_.e_per_radiance * squares_;
  spread(noise_kernel_, region, weight_, weight_);
  std::copy_n(variance_of_one.begin(), pixels, work_.begin());
  // Few replicates know a pixel's variance badly; its neighbours are much like it.
  spread(neighbours_, region, work_, work_);
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    work_[i] = std::sqrt(work_[i] * weight_[i] * static_cast<float>(to_e2));
    sum += static_cast<double>(work_[i]);
  }
  const double scale = sum / (wish.limit * wish.limit * lit.lit_px);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double wanted = std::ceil(static_cast<double>(work_[i]) * scale);
    samples[i] = static_cast<std::uint32_t>(
        std::clamp(wanted, static_cast<double>(wish.least), static_cast<double>(wish.most)));
  }
}

}  // namespace engine
