#include "tools/chart/light_error.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace chart {
namespace {

constexpr int kNear_px = 32;
constexpr double kEdgeSigmas = 5.0;

constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

LightStack::LightStack(int width, int height, double full_well_e)
    : width_(width),
      height_(height),
      full_well_e_(full_well_e),
      mean_e_(at(width) * at(height)),
      squares_e2_(mean_e_.size()) {}

/// Welford 1962, DOI 10.1080/00401706.1962.10490022.
void LightStack::add(const engine::IrradianceImage& light, double e_per_irradiance) {
  ENSURE(light.width() == width_ && light.height() == height_);
  ++frames_;
  for (std::size_t i = 0; i < mean_e_.size(); ++i) {
    const double e =
        std::min(full_well_e_, static_cast<double>(light.pixels()[i]) * e_per_irradiance);
    const double off = e - mean_e_[i];
    mean_e_[i] += off / frames_;
    squares_e2_[i] += off * (e - mean_e_[i]);
  }
}

PixelSorter::PixelSorter(const LightStack& reference, const engine::TruthMask& mask,
                         const engine::DetectorSpec& detector, engine::Duration exposure)
    : reference_(reference),
      detector_(detector),
      dark_e_(detector.dark_mean_e(exposure)),
      classes_(at(reference.width()) * at(reference.height()), PixelClass::kElsewhere) {
  const int width = reference.width();
  const int height = reference.height();
  if (mask.runs().empty()) std::ranges::fill(classes_, PixelClass::kSky);
  for (const engine::TruthMask::Run& run : mask.runs())
    for (int v = std::max(0, run.row - kNear_px); v < std::min(height, run.row + kNear_px + 1); ++v)
      std::fill(classes_.begin() + v * width + std::max(0, run.begin - kNear_px),
                classes_.begin() + v * width + std::min(width, run.end + kNear_px),
                PixelClass::kSky);
  for (const engine::TruthMask::Run& run : mask.runs()) {
    for (int u = run.begin; u < run.end; ++u) {
      const std::size_t i = at(run.row) * at(width) + at(u);
      const double limit_e = kEdgeSigmas * noise_e(i);
      const auto jumps = [&](bool inside, std::ptrdiff_t step) {
        return inside && std::abs(reference_.mean_e(i + at(static_cast<int>(step))) -
                                  reference_.mean_e(i)) > limit_e;
      };
      const bool edge = jumps(u > 0, -1) || jumps(u + 1 < width, 1) || jumps(run.row > 0, -width) ||
                        jumps(run.row + 1 < height, width);
      classes_[i] = edge ? PixelClass::kEdge : PixelClass::kLit;
    }
  }
}

double PixelSorter::noise_e(std::size_t i) const noexcept {
  return detector_.noise_e(std::max(reference_.mean_e(i), 0.0) + dark_e_);
}

ClassError PixelSorter::compare(const LightStack& frames, bool (*wanted)(PixelClass)) const {
  ClassError error;
  double bias2 = 0;
  double noise2 = 0;
  double reference2 = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    if (!wanted(classes_[i])) continue;
    ++error.px;
    const double per_variance = 1.0 / std::pow(noise_e(i), 2);
    const double known = reference_.variance_e2(i) / reference_.frames();
    const double scatter = frames.variance_e2(i);
    const double off_e = frames.mean_e(i) - reference_.mean_e(i);
    bias2 += (off_e * off_e - scatter / frames.frames() - known) * per_variance;
    noise2 += scatter * per_variance;
    reference2 += known * per_variance;
  }
  if (error.px == 0) return error;
  bias2 = std::max(bias2, 0.0);
  error.rho = std::sqrt((bias2 + noise2) / error.px);
  error.bias = std::sqrt(bias2 / error.px);
  error.noise = std::sqrt(noise2 / error.px);
  error.reference = std::sqrt(reference2 / error.px);
  return error;
}

LightError PixelSorter::compare(const LightStack& frames) const {
  LightError error;
  error.lit =
      compare(frames, [](PixelClass c) { return c == PixelClass::kLit || c == PixelClass::kEdge; });
  error.edge = compare(frames, [](PixelClass c) { return c == PixelClass::kEdge; });
  error.sky = compare(frames, [](PixelClass c) { return c == PixelClass::kSky; });
  if (error.lit.px == 0) return error;

  // The background under the target is taken to be as round it.
  double sky_e = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i)
    if (classes_[i] == PixelClass::kSky) sky_e += reference_.mean_e(i);
  if (error.sky.px > 0) sky_e /= error.sky.px;
  double light = 0;
  double light_u = 0;
  double light_v = 0;
  double more = 0;
  double more_u = 0;
  double more_v = 0;
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    if (classes_[i] == PixelClass::kElsewhere) continue;
    const auto u = static_cast<double>(i % at(reference_.width()));
    const auto v = static_cast<double>(i / at(reference_.width()));
    const double off_e = frames.mean_e(i) - reference_.mean_e(i);
    more += off_e;
    more_u += off_e * u;
    more_v += off_e * v;
    if (classes_[i] == PixelClass::kSky) continue;
    const double e = reference_.mean_e(i) - sky_e;
    light += e;
    light_u += e * u;
    light_v += e * v;
  }
  if (!(light > 0.0)) return error;
  error.flux_share = more / light;
  // The centre of the sum of both, from that of the reference.
  const double all = light + more;
  if (all > 0.0)
    error.centroid_px = std::hypot((more_u - more * light_u / light) / all,
                                   (more_v - more * light_v / light) / all);
  return error;
}

}  // namespace chart
