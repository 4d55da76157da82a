#include "tools/characterize/slanted_edge.h"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace {

using characterize::EdgeImage;
using characterize::EdgeResponse;

/// An edge blurred by a Gaussian, each pixel a sample of it.
EdgeImage gaussian_edge(double sigma_px, double angle_deg, int height, double noise = 0) {
  std::mt19937 chance(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  EdgeImage image{140, height, {}};
  const double c = std::cos(angle_deg * engine::kDegree);
  const double s = std::sin(angle_deg * engine::kDegree);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double distance = (u - 70.3) * c - (v - 0.5 * height) * s;
      const double spread = 0.5 * std::erfc(-distance / sigma_px / std::sqrt(2.0));
      image.value.push_back(static_cast<float>(spread + noise * normal(chance)));
    }
  }
  return image;
}

double worst_against_gaussian(const EdgeResponse& response, double sigma_px) {
  double worst = 0;
  for (std::size_t i = 0; i < response.mtf.size(); ++i) {
    const double f = response.cycles_per_px[i];
    const double truth = std::exp(-2.0 * std::pow(engine::kPi * sigma_px * f, 2));
    worst = std::max(worst, std::abs(response.mtf[i] - truth));
  }
  return worst;
}

TEST(SlantedEdge, FindsTheTransferOfAGaussian) {
  for (const double angle_deg : {2.0, 5.0, 9.7, -5.0}) {
    for (const double sigma_px : {0.4, 0.7, 1.5}) {
      const EdgeResponse response =
          characterize::slanted_edge(gaussian_edge(sigma_px, angle_deg, 300), 30);
      EXPECT_NEAR(response.slope, std::tan(angle_deg * engine::kDegree), 1e-4);
      // Within a bin of a fourth of a pixel the spread function bends.
      EXPECT_LT(worst_against_gaussian(response, sigma_px), 1e-3) << angle_deg << ' ' << sigma_px;
    }
  }
}

TEST(SlantedEdge, HoldsInNoise) {
  // Noise of .2 % in each pixel, 75 to a bin, over 240 bins: .004 at the highest frequency.
  const auto response = characterize::slanted_edge(gaussian_edge(0.5, 5.0, 300, 0.002), 30);
  EXPECT_LT(worst_against_gaussian(response, 0.5), 3 * 0.004);
}

TEST(SlantedEdge, TellsABlurThatIsATenthLarger) {
  const auto response = characterize::slanted_edge(gaussian_edge(0.55, 5.0, 300), 30);
  EXPECT_GT(worst_against_gaussian(response, 0.5), 0.03);
}

TEST(SlantedEdge, DoesNotCountDeadPixels) {
  EdgeImage image = gaussian_edge(0.5, 5.0, 300);
  for (std::size_t i = 0; i < image.value.size(); i += 97)
    image.value[i] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_LT(worst_against_gaussian(characterize::slanted_edge(image, 30), 0.5), 5e-3);
}

TEST(SlantedEdge, RefusesAnImageWithoutOne) {
  EXPECT_THROW((void)characterize::slanted_edge({64, 64, std::vector<float>(64 * 64, 0.5F)}, 20),
               std::runtime_error);
  EXPECT_THROW((void)characterize::slanted_edge(gaussian_edge(0.5, 5.0, 300), 90),
               std::runtime_error);
}

TEST(HalfPlane, CellsHaveTheAreaThatTheLineLeavesThem) {
  const double angle = 0.4;
  const engine::PixelPoint normal{std::cos(angle), std::sin(angle)};
  const engine::PixelRect region{-2, -1, 4, 5};
  const auto light = characterize::half_plane(region, 3, {1.2, 1.9}, normal, 2.0);
  constexpr int kFine = 100;  // points on a cell's side: areas to a hundredth
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      int beyond = 0;
      for (int k = 0; k < kFine * kFine; ++k) {
        const double u = region.left - 0.5 + (x + (k % kFine + 0.5) / kFine) / 3.0;
        const double v = region.top - 0.5 + (y + (k / kFine + 0.5) / kFine) / 3.0;
        beyond += (u - 1.2) * normal.u + (v - 1.9) * normal.v > 0.0 ? 1 : 0;
      }
      EXPECT_NEAR(static_cast<double>(light.at(x, y)), 2.0 * beyond / (kFine * kFine), 0.01);
    }
  }
}

}  // namespace
