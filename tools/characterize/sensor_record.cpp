#include "tools/characterize/sensor_record.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace characterize {
namespace {

using engine::Duration;

constexpr Duration kShortest = std::chrono::microseconds(1);
constexpr double kLongest_s = 1000;
constexpr double kDarkShare = 0.05;  // of the largest DN, that the longest exposure shows
constexpr int kExposures = 16;
constexpr int kDefectFrames = 16;

std::size_t pixels_of(const Bench& bench) {
  return static_cast<std::size_t>(bench.camera().width_px) *
         static_cast<std::size_t>(bench.camera().height_px);
}

/// Of one frame, in DN: hot and dead pixels do not count.
double median_dn(const engine::DnImage& frame) {
  std::vector<std::uint16_t> dn(frame.pixels().begin(), frame.pixels().end());
  const auto middle = dn.begin() + static_cast<std::ptrdiff_t>(dn.size() / 2);
  std::nth_element(dn.begin(), middle, dn.end());
  return *middle;
}

/// The irradiance at which the image has all but reached what more light cannot change.
double saturating_w_m2(Bench& bench, Duration exposure) {
  constexpr double kNear = 0.995;
  const auto response = [&](double irradiance_w_m2) {
    bench.illuminate(irradiance_w_m2);
    return median_dn(bench.frame(exposure));
  };
  const double dark_dn = response(0.0);
  double high = 100.0 / bench.photons_per_irradiance(exposure);
  double top_dn = response(high);
  for (int doublings = 0;; ++doublings) {
    const double next_dn = response(2.0 * high);
    if (top_dn > dark_dn && next_dn - dark_dn < 1.001 * (top_dn - dark_dn)) break;
    if (doublings > 40)
      throw std::runtime_error(top_dn > dark_dn ? "no light saturates the sensor"
                                                : "no light makes a signal in the sensor");
    top_dn = next_dn;
    high *= 2.0;
  }
  double low = 0;
  while (high - low > 1e-3 * high) {
    const double middle = 0.5 * (low + high);
    (response(middle) - dark_dn < kNear * (top_dn - dark_dn) ? low : high) = middle;
  }
  return high;
}

Duration longest_exposure(Bench& bench, Duration exposure) {
  bench.illuminate(0.0);
  const double enough_dn = median_dn(bench.frame(kShortest)) + kDarkShare * bench.largest_dn();
  Duration longest = exposure;
  while (engine::seconds(longest) < kLongest_s && median_dn(bench.frame(longest)) < enough_dn)
    longest *= 2;
  return longest;
}

StackFigures figures_of(const ImageStack& stack, Duration exposure) {
  return {engine::seconds(exposure), stack.mean_dn(), stack.temporal_variance_dn2(),
          stack.spatial_variance_dn2(), stack.share_at_zero()};
}

void find_defects(Bench& bench, Duration exposure, bool in_dark, SensorRecord& out) {
  const PixelMask all(out.used.size(), 1);
  const ImageStack stack = bench.stack(exposure, kDefectFrames, all);
  const double least_dn2 = std::max(stack.temporal_variance_dn2().value, kQuantisingVariance_dn2);
  for (const std::size_t pixel :
       outliers(stack.mean_image_dn(), kDefectSigmas, std::sqrt(least_dn2 / kDefectFrames))) {
    if (out.used[pixel] == 0) continue;
    out.used[pixel] = 0;
    out.defects.push_back({pixel, in_dark});
  }
}

/// Even steps of light up to saturation, finer ones where the variance has its peak, and a few
/// between dark and the first, where quantiser and read noise rule.
std::vector<double> shares_of_light(int levels) {
  constexpr double kFaintest = 1e-4;
  constexpr int kFaint = 12;
  constexpr double kFineFrom = 0.8;
  constexpr double kFineTo = 1.06;
  constexpr double kFineStep = 0.005;
  const double step = 1.0 / levels;
  std::vector<double> shares{0.0};
  for (int i = 0; i < kFaint; ++i)
    shares.push_back(kFaintest * std::pow(step / kFaintest, 1.0 * i / kFaint));
  for (int i = 1; i * step < kFineFrom; ++i) shares.push_back(i * step);
  for (int i = 0; kFineFrom + i * kFineStep <= kFineTo; ++i)
    shares.push_back(kFineFrom + i * kFineStep);
  return shares;
}

}  // namespace

int frames_for(std::size_t values, const engine::CameraGeometry& camera, int least, int most) {
  const double frames = static_cast<double>(values) / (1.0 * camera.width_px * camera.height_px);
  return 2 * static_cast<int>(std::ceil(0.5 * std::clamp(frames, 1.0 * least, 1.0 * most)));
}

SensorRecord record_sensor(Bench& bench, Duration exposure, const RecordPlan& plan) {
  SensorRecord out;
  out.exposure_s = engine::seconds(exposure);
  out.used.assign(pixels_of(bench), 1);
  const double full_w_m2 = saturating_w_m2(bench, exposure);
  const Duration longest = longest_exposure(bench, exposure);
  const int frames = frames_for(plan.level_values, bench.camera(), 2, 32);
  const int many = frames_for(plan.stack_values, bench.camera(), kDefectFrames, 64);

  // Defects first: they count nowhere.
  bench.illuminate(0.0);
  find_defects(bench, longest, true, out);
  bench.illuminate(0.5 * full_w_m2);
  find_defects(bench, exposure, false, out);

  for (const double share : shares_of_light(plan.levels)) {
    bench.illuminate(share * full_w_m2);
    const ImageStack stack = bench.stack(exposure, frames, out.used);
    const double irradiance_w_m2 = bench.irradiance_w_m2();
    out.light.push_back({irradiance_w_m2, irradiance_w_m2 * bench.photons_per_irradiance(exposure),
                         stack.mean_dn(), stack.temporal_variance_dn2(),
                         stack.spatial_variance_dn2()});
  }
  bench.illuminate(0.5 * full_w_m2);
  out.half_stack = figures_of(bench.stack(exposure, many, out.used), exposure);
  bench.illuminate(2.0 * full_w_m2);
  out.brightest_dn = bench.stack(exposure, frames, out.used).mean_dn();

  bench.illuminate(0.0);
  for (int i = 0; i <= kExposures; ++i) {
    const Duration here = i == 0 ? kShortest : longest * i / kExposures;
    out.dark.push_back(figures_of(bench.stack(here, frames, out.used), here));
  }
  out.dark_stack = figures_of(bench.stack(exposure, many, out.used), exposure);
  out.long_dark_stack = figures_of(bench.stack(longest, many, out.used), longest);
  return out;
}

}  // namespace characterize
