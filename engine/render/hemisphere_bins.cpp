#include "engine/render/hemisphere_bins.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// A lobe whose half vector stays within this is a mirror to the bins: they are twice as wide.
constexpr double kNarrow_rad = 4.0 * kDegree;
constexpr int kStepsInBin = 4;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

Vector3f HemisphereBins::direction(std::size_t bin, float a, float b) noexcept {
  const std::size_t column = bin % kSide;
  const std::size_t row = bin / kSide;
  const auto x = 2.0F * (static_cast<float>(column) + a) / kSide - 1.0F;
  const auto y = 2.0F * (static_cast<float>(row) + b) / kSide - 1.0F;
  constexpr auto kQuarter = static_cast<float>(kPi / 4.0);
  float r = 0.0F;
  float phi = 0.0F;
  if (std::abs(x) > std::abs(y)) {
    r = x;
    phi = kQuarter * y / x;
  } else if (y != 0.0F) {
    r = y;
    phi = 2.0F * kQuarter - kQuarter * x / y;
  }
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0F, 1.0F - r * r))};
}

namespace {

/// Where see() looks, by quarter of a bin.
const std::array<Vector3f, std::tuple_size_v<HemisphereBins::FineValues>> kLooks = [] {
  std::array<Vector3f, std::tuple_size_v<HemisphereBins::FineValues>> looks;
  // Places at the same height in each would meet the limb all at once: R2 of Roberts 2018 spreads
  // them.
  constexpr std::array<float, 2> kSteps = {0.75487767F, 0.56984029F};
  float a = 0.25F;
  float b = 0.75F;
  for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
    for (const float half_a : {0.0F, 0.5F}) {
      for (const float half_b : {0.0F, 0.5F}) {
        a += kSteps[0] - (a + kSteps[0] < 1.0F ? 0.0F : 1.0F);
        b += kSteps[1] - (b + kSteps[1] < 1.0F ? 0.0F : 1.0F);
        looks[HemisphereBins::fine(bin, half_a, half_b)] =
            HemisphereBins::direction(bin, half_a + 0.5F * a, half_b + 0.5F * b);
      }
    }
  }
  return looks;
}();

}  // namespace

void HemisphereBins::see(const EarthLight& cap, const Eigen::Matrix3f& axes,
                         FineValues& out) noexcept {
  const Eigen::Matrix3f to_body = axes.transpose();
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<float>(cap.radiance_w_m2_sr((to_body * kLooks[i]).cast<double>()));
}

BinnedBrdf::BinnedBrdf(const Brdf& brdf)
    : diffuse_share_(static_cast<float>(brdf.diffuse_albedo() / HemisphereBins::kBins)),
      narrow_(brdf.lobe_half_width_rad() < kNarrow_rad) {
  if (brdf.lobe_half_width_rad() == 0.0) return;
  if (!narrow_) {
    tabulate(brdf);
    return;
  }
  for (std::size_t i = 0; i < kCosines; ++i) {
    const double c = (static_cast<double>(i) + 0.5) / kCosines;
    mirror_share_[i] = static_cast<float>(std::max(0.0, brdf.albedo(c) - brdf.diffuse_albedo()));
  }
}

void BinnedBrdf::tabulate(const Brdf& brdf) {
  weights_.resize(kCosines * kAzimuths);
  fine_weights_.resize(weights_.size());
  for (std::size_t i = 0; i < kCosines; ++i) {
    const double c = (static_cast<double>(i) + 0.5) / kCosines;
    const double s = std::sqrt(1.0 - c * c);
    for (std::size_t k = 0; k < kAzimuths; ++k) {
      const double azimuth = 2.0 * kPi * static_cast<double>(k) / kAzimuths;
      const Vector3d out(s * std::cos(azimuth), s * std::sin(azimuth), c);
      const std::size_t row = i * kAzimuths + k;
      for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
        double mean = 0;
        for (int p = 0; p < kStepsInBin * kStepsInBin; ++p) {
          const int along = p % kStepsInBin;
          const int up = p / kStepsInBin;
          const float a = (static_cast<float>(along) + 0.5F) / kStepsInBin;
          const float b = (static_cast<float>(up) + 0.5F) / kStepsInBin;
          const Vector3f in = HemisphereBins::direction(bin, a, b);
          // A bin holds pi/64 of the integral over the hemisphere by the cosine.
          const double share = brdf.eval(in.cast<double>(), out) * kPi /
                               (HemisphereBins::kBins * kStepsInBin * kStepsInBin);
          mean += share;
          fine_weights_[row][HemisphereBins::fine(bin, a, b)] += static_cast<float>(4.0 * share);
        }
        weights_[row][bin] = static_cast<float>(mean);
      }
    }
  }
}

BinnedBrdf::Rows BinnedBrdf::rows_round(const Vector3f& out) noexcept {
  const float cell = std::clamp(out.z() * kCosines - 0.5F, 0.0F, kCosines - 1.0F);
  const auto low = std::min(static_cast<std::size_t>(cell), kCosines - 2);
  const float part = cell - static_cast<float>(low);
  constexpr auto kPerTurn = static_cast<float>(kAzimuths / (2.0 * kPi));
  const float turn = std::atan2(out.y(), out.x()) * kPerTurn + kAzimuths;
  const float whole = std::floor(turn);
  const float between = turn - whole;
  const std::size_t left = at(static_cast<int>(whole)) % kAzimuths;
  const std::size_t right = (left + 1) % kAzimuths;
  return {{low * kAzimuths + left, low * kAzimuths + right, (low + 1) * kAzimuths + left,
           (low + 1) * kAzimuths + right},
          {(1.0F - part) * (1.0F - between), (1.0F - part) * between, part * (1.0F - between),
           part * between}};
}

float BinnedBrdf::reflected(const HemisphereBins::Values& arriving,
                            const Vector3f& out) const noexcept {
  if (weights_.empty()) {
    float sum = 0.0F;
    for (const float a : arriving) sum += a;
    return diffuse_share_ * sum;
  }
  const Rows rows = rows_round(out);
  std::array<float, 16> sums{};
  for (std::size_t i = 0; i < HemisphereBins::kBins; ++i) {
    float weight = 0.0F;
    for (std::size_t r = 0; r < rows.index.size(); ++r)
      weight += rows.share[r] * weights_[rows.index[r]][i];
    sums[i % sums.size()] += arriving[i] * weight;
  }
  float sum = 0.0F;
  for (const float s : sums) sum += s;
  return sum;
}

void BinnedBrdf::weigh(const Vector3f& out, HemisphereBins::FineValues& weights) const noexcept {
  const Rows rows = rows_round(out);
  weights.fill(0.0F);
  for (std::size_t r = 0; r < rows.index.size(); ++r)
    for (std::size_t i = 0; i < weights.size(); ++i)
      weights[i] += rows.share[r] * fine_weights_[rows.index[r]][i];
}

float BinnedBrdf::mirror_share(float cos_out) const noexcept {
  if (!narrow_) return 0.0F;
  const float cell = std::clamp(cos_out * kCosines - 0.5F, 0.0F, kCosines - 1.0F);
  const auto low = std::min(static_cast<std::size_t>(cell), kCosines - 2);
  const float part = cell - static_cast<float>(low);
  return mirror_share_[low] + part * (mirror_share_[low + 1] - mirror_share_[low]);
}

}  // namespace engine
