#include "tools/quality/image_quality.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/contract.h"

namespace quality {
namespace {

constexpr int kLeast_px = 8;
// About the target, what of its edges lies below three sigma.
constexpr int kMargin_px = 2;
// A sum of squares of noise is none beyond this many of its own sigmas.
constexpr double kSureSigmas = 5.0;

// Differences of white noise: their mean squares over its variance, and the sums of squares of
// their autocorrelations, which say how much sums of these squares scatter. Of one direction's
// difference: 2; 2 (4 + 1 + 1). Of the sum of both: 4; twice 12 and the four products between them,
// both ways round. Of the Laplacian: 20; 2 (400 + 4 64 + 4 4 + 4 1).
constexpr double kDifference = 2.0;
constexpr double kDifferenceScatter = 12.0;
constexpr double kGradient = 4.0;
constexpr double kGradientScatter = 40.0;
constexpr double kLaplacian = 20.0;
constexpr double kLaplacianScatter = 1352.0;

/// Of an edge of unit height and Gaussian blur s, sampled every pixel at an even phase: the mean
/// square of the difference over k pixels.
double edge_step(double k, double s) {
  const double x = 0.5 * k / s;
  return k * std::erf(x) + 2.0 * s / std::sqrt(engine::kPi) * std::expm1(-x * x);
}

/// The same edge's power of the second difference over that of the first.
double edge_ratio(double s) { return 4.0 - edge_step(2.0, s) / edge_step(1.0, s); }

/// That blur, by bisection: the ratio falls from 2 as s grows.
std::optional<double> edge_of(double ratio) {
  double low = 0.05;
  double high = 50.0;
  if (!(ratio < edge_ratio(low)) || !(ratio > edge_ratio(high))) return std::nullopt;
  for (int i = 0; i < 40; ++i) {
    const double middle = std::sqrt(low * high);
    (edge_ratio(middle) > ratio ? low : high) = middle;
  }
  return low;
}

}  // namespace

std::string_view name_of(Verdict verdict) noexcept {
  constexpr std::array<std::string_view, kVerdicts> kNames{"measured", "too_small", "full_scale",
                                                           "nothing", "too_faint"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::string_view sentence_of(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::kMeasured:
      return "measured";
    case Verdict::kTooSmall:
      return "the frame is too small to have a background";
    case Verdict::kFullScale:
      return "the background is at full scale";
    case Verdict::kNothing:
      return "nothing stands out of the background";
    case Verdict::kTooFaint:
      return "no edge stands out of the noise";
  }
  return "";
}

/// Over the pixels of the target and its margin.
struct Meter::Sums {
  double uu = 0, vv = 0, uv = 0;  ///< of the gradient over the noise variance
  double gradients = 0;           ///< how many
  double gradient_dn2 = 0, gradient_scatter_dn4 = 0;
  double laplacian_dn2 = 0, laplacian_scatter_dn4 = 0;
  int saturated = 0;
};

Meter::Meter(int largest_width_px, int largest_height_px)
    : background_(largest_width_px, largest_height_px),
      blobs_(largest_width_px, largest_height_px),
      mask_(static_cast<std::size_t>(largest_width_px) *
            static_cast<std::size_t>(largest_height_px)),
      variance_dn2_(65536) {}

void Meter::mark(const engine::DnImage& frame, const Blob& blob,
                 const engine::PixelRect& box) noexcept {
  const auto width = static_cast<std::size_t>(box.width());
  const auto area = width * static_cast<std::size_t>(box.height());
  ENSURE(area <= mask_.size());
  const auto mask = std::span(mask_).first(area);
  if (blobs_.runs().empty()) {
    std::fill(mask.begin(), mask.end(), std::uint8_t{1});
    return;
  }
  std::fill(mask.begin(), mask.end(), std::uint8_t{0});
  for (std::size_t i = blob.first; i < blobs_.runs().size(); ++i) {
    const LitRun& run = blobs_.runs()[i];
    if (run.row >= blob.box.bottom) break;
    if (run.parent != blob.first) continue;
    const int left = std::max(run.begin - kMargin_px, 0) - box.left;
    const int right = std::min(run.end + kMargin_px, frame.width()) - box.left;
    const int bottom = std::min(run.row + kMargin_px + 1, frame.height());
    for (int v = std::max(run.row - kMargin_px, 0); v < bottom; ++v) {
      std::uint8_t* row = mask.data() + static_cast<std::size_t>(v - box.top) * width;
      std::fill(row + left, row + right, std::uint8_t{1});
    }
  }
}

void Meter::fill_variances(const CameraFigures& camera, double background_dn,
                           double dark_dn2) noexcept {
  for (std::size_t dn = 0; dn <= static_cast<std::size_t>(camera.largest_dn); ++dn) {
    const double light_dn = std::max(0.0, static_cast<double>(dn) - background_dn);
    const double photons_dn2 = camera.e_per_dn > 0.0 ? light_dn / camera.e_per_dn : 0.0;
    variance_dn2_[dn] = static_cast<float>(dark_dn2 + photons_dn2);
  }
}

Meter::Sums Meter::sum(const engine::DnImage& frame, const engine::PixelRect& box,
                       const CameraFigures& camera) noexcept {
  const int full = camera.largest_dn;
  Sums s;
  // Where all neighbours are.
  const engine::PixelRect inner = box.clipped_to({1, 1, frame.width() - 1, frame.height() - 1});
  for (int v = inner.top; v < inner.bottom; ++v) {
    const std::uint8_t* mask = mask_.data() + static_cast<std::size_t>(v - box.top) *
                                                  static_cast<std::size_t>(box.width());
    const std::uint16_t* above = frame.row(v - 1).data();
    const std::uint16_t* here = frame.row(v).data();
    const std::uint16_t* below = frame.row(v + 1).data();
    for (int u = inner.left; u < inner.right; ++u) {
      if (mask[u - box.left] == 0) continue;
      const int p = here[u];
      // What is clipped hides its edges, and makes one of its own.
      if (p >= full || here[u + 1] >= full || below[u] >= full || here[u - 1] >= full ||
          above[u] >= full) {
        s.saturated += p >= full ? 1 : 0;
        continue;
      }
      const double du = here[u + 1] - p;
      const double dv = below[u] - p;
      const double lap = here[u + 1] + here[u - 1] + above[u] + below[u] - 4 * p;
      const double noise_dn2 = (variance_dn2_[static_cast<std::size_t>(p)] +
                                variance_dn2_[here[u + 1]] + variance_dn2_[below[u]]) *
                               (1.0F / 3.0F);
      const double weight = 1.0 / noise_dn2;
      s.uu += du * du * weight;
      s.vv += dv * dv * weight;
      s.uv += du * dv * weight;
      s.gradients += 1.0;
      s.gradient_dn2 += du * du + dv * dv - kGradient * noise_dn2;
      s.gradient_scatter_dn4 += kGradientScatter * noise_dn2 * noise_dn2;
      s.laplacian_dn2 += lap * lap - kLaplacian * noise_dn2;
      s.laplacian_scatter_dn4 += kLaplacianScatter * noise_dn2 * noise_dn2;
    }
  }
  s.uu -= kDifference * s.gradients;
  s.vv -= kDifference * s.gradients;
  // Both differences have the pixel itself in them.
  s.uv -= s.gradients;
  return s;
}

ImageQuality Meter::measure(const engine::DnImage& frame, const CameraFigures& camera) noexcept {
  ImageQuality q;
  q.verdict = Verdict::kTooSmall;
  if (std::min(frame.width(), frame.height()) < kLeast_px) return q;
  background_.measure(frame);
  q.background_dn = background_.level_dn();
  q.noise_dn = background_.sigma_dn();
  q.even_background = background_.even();
  q.verdict = Verdict::kFullScale;
  if (q.background_dn > camera.largest_dn - 0.5) return q;
  q.verdict = Verdict::kNothing;
  const Blob blob = blobs_.find(frame, background_);
  if (blob.pixels == 0) return q;
  q.box = blob.box;
  q.lit_px = blob.pixels;
  q.contrast_dn = std::sqrt(blob.power_dn2 / blob.pixels);
  q.contrast_sigma = q.contrast_dn / std::sqrt(background_.variance_dn2());

  const engine::PixelRect box =
      blob.box.grown_by(kMargin_px).clipped_to({0, 0, frame.width(), frame.height()});
  mark(frame, blob, box);
  fill_variances(camera, q.background_dn, background_.variance_dn2());
  const Sums s = sum(frame, box, camera);
  q.saturated_px = s.saturated;
  q.verdict = Verdict::kTooFaint;
  // The eigenvalues of J.
  const double mean = 0.5 * (s.uu + s.vv);
  const double apart = std::hypot(0.5 * (s.uu - s.vv), s.uv);
  if (mean - apart <= kSureSigmas * std::sqrt(kDifferenceScatter * s.gradients)) return q;
  q.verdict = Verdict::kMeasured;
  q.place_px = std::sqrt(1.0 / (mean - apart) + 1.0 / (mean + apart));
  q.score_db = -20.0 * std::log10(*q.place_px);
  if (s.gradient_dn2 <= kSureSigmas * std::sqrt(s.gradient_scatter_dn4) ||
      s.laplacian_dn2 <= kSureSigmas * std::sqrt(s.laplacian_scatter_dn4))
    return q;
  const double ratio = s.laplacian_dn2 / s.gradient_dn2;
  q.sharpness = 2.0 / engine::kPi * std::asin(std::min(1.0, 0.5 * std::sqrt(ratio)));
  q.edge_px = edge_of(ratio);
  return q;
}

}  // namespace quality
