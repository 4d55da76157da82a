#include "engine/detector/cosmic_rays.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::Moments;

constexpr Duration kSecond = std::chrono::seconds(1);

DetectorSpec with_rays(double rays_a_frame, int side_px, double epitaxial_um = 15) {
  DetectorSpec spec;
  const double side_cm = 100.0 * spec.pixel_pitch_m * side_px;
  spec.cosmic_rays_cm2_s = rays_a_frame / (side_cm * side_cm);
  spec.epitaxial_um = epitaxial_um;
  return spec;
}

TEST(CosmicRays, ComeAtAPoissonRate) {
  constexpr int kFrames = 20000;
  const DetectorSpec spec = with_rays(2.5, 16);
  std::vector<double> observed(20, 0.0);
  std::vector<double> expected(20);
  ElectronImage image(16, 16);
  for (std::uint64_t frame = 0; frame < kFrames; ++frame)
    observed[static_cast<std::size_t>(add_cosmic_rays(spec, kSecond, 1, frame, {}, image))] += 1.0;
  double p = std::exp(-2.5);
  for (int k = 0; k < 20; ++k) {
    expected[static_cast<std::size_t>(k)] = kFrames * p;
    p *= 2.5 / (k + 1);
  }
  EXPECT_GT(test_support::histogram_p(observed, expected), 1e-3);
}

/// What one ray in an empty frame leaves.
struct Trace {
  double charge_e = 0;
  double across_px = 0;  ///< between the centres of its first and last pixel
  bool inside = true;    ///< nowhere at the frame's edge
  double du = 0;
  double dv = 0;
};

std::vector<Trace> traces(double epitaxial_um, int wanted) {
  constexpr int kSide_px = 256;
  const DetectorSpec spec = with_rays(1.0, kSide_px, epitaxial_um);
  std::vector<Trace> all;
  for (std::uint64_t frame = 0; static_cast<int>(all.size()) < wanted; ++frame) {
    ElectronImage image(kSide_px, kSide_px);
    if (add_cosmic_rays(spec, kSecond, 1, frame, {}, image) != 1) continue;
    Trace trace;
    PixelRect box{kSide_px, kSide_px, -1, -1};
    for (int v = 0; v < kSide_px; ++v)
      for (int u = 0; u < kSide_px; ++u) {
        const float e = image.at(u, v);
        if (e == 0.0F) continue;
        EXPECT_GT(e, 0.0F);
        EXPECT_EQ(e, std::floor(e));
        trace.charge_e += static_cast<double>(e);
        box = {std::min(box.left, u), std::min(box.top, v), std::max(box.right, u),
               std::max(box.bottom, v)};
      }
    trace.du = box.right - box.left;
    trace.dv = box.bottom - box.top;
    trace.across_px = std::hypot(trace.du, trace.dv);
    trace.inside =
        box.left > 0 && box.top > 0 && box.right < kSide_px - 1 && box.bottom < kSide_px - 1;
    all.push_back(trace);
  }
  return all;
}

TEST(CosmicRays, LeaveChargeByTheLengthOfTheirPath) {
  // Long tracks in a layer of 100 um, whose ends a pixel or so does not blur.
  Moments per_um;
  for (const Trace& trace : traces(100.0, 3000)) {
    if (!trace.inside || trace.across_px < 30.0) continue;
    // An end lies anywhere in its pixel: on average the centres are as far apart as the ends.
    per_um.add(trace.charge_e / std::hypot(100.0, 6.5 * trace.across_px));
  }
  EXPECT_GT(per_um.count(), 200U);
  // The mean of Moyal's distribution is 1.27 widths above its peak; an end is off by .4 px rms, 2 %
  // of the shortest.
  EXPECT_NEAR(per_um.mean(), 80.0 + 1.2704 * 4.9, 4.5 * per_um.sigma_of_mean() + 1.0);
  // Its spread is pi / sqrt(2) widths.
  EXPECT_NEAR(std::sqrt(per_um.variance()), 4.9 * 2.2214, 3.0);
}

TEST(CosmicRays, AreShortWhenTheLayerIs) {
  // Half of all come within 45 degrees of the normal, through 15 um: at most 2.3 px.
  std::vector<double> across;
  for (const Trace& trace : traces(15.0, 2000)) across.push_back(trace.across_px);
  std::ranges::sort(across);
  EXPECT_LE(across[900], 4.3);  // a pixel more at either end, and 4.5 sigma of 2000
  EXPECT_GT(across[1990], 15.0);
}

TEST(CosmicRays, HaveNoDirectionOfTheirOwn) {
  Moments difference;
  for (const Trace& trace : traces(100.0, 2000))
    if (trace.inside) difference.add(trace.du - trace.dv);
  EXPECT_LT(std::abs(difference.mean()), 4.5 * difference.sigma_of_mean());
}

TEST(CosmicRays, AreTheFramesOwn) {
  const DetectorSpec spec = with_rays(20.0, 64);
  const auto frame_of = [&](std::uint64_t seed, std::uint64_t frame) {
    ElectronImage image(64, 64);
    add_cosmic_rays(spec, kSecond, seed, frame, {}, image);
    return std::vector<float>(image.pixels().begin(), image.pixels().end());
  };
  EXPECT_EQ(frame_of(1, 2), frame_of(1, 2));
  EXPECT_NE(frame_of(1, 2), frame_of(1, 3));
  EXPECT_NE(frame_of(1, 2), frame_of(2, 2));
}

TEST(CosmicRays, LeaveDeadPixelsEmpty) {
  const DetectorSpec spec = with_rays(100.0, 32);
  std::vector<float> response(32 * 32, 1.0F);
  for (std::size_t i = 0; i < response.size(); i += 2) response[i] = 0.0F;
  ElectronImage image(32, 32);
  EXPECT_GT(add_cosmic_rays(spec, kSecond, 1, 0, response, image), 50);
  for (std::size_t i = 0; i < response.size(); i += 2) ASSERT_EQ(image.pixels()[i], 0.0F);
}

}  // namespace
}  // namespace engine
