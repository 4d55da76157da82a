#include "engine/optics/blur.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kStep = 3;
constexpr int kSamples = 64;
constexpr double kSigma_px = 0.9;

/// A Gaussian of the radius, down to 1e-14 at the table's end.
std::vector<float> gaussian_table() {
  std::vector<float> table(4098, 0.0F);
  for (int i = 0; i < 4096; ++i) {
    const double turns = 2.0 * kPi * kSigma_px * 1.4 * i / 4096.0;
    table[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(-0.5 * turns * turns));
  }
  return table;
}

/// Blurs `picture` on a grid of 64 x 64 samples, its first cell on cell (left, top).
std::vector<float> blurred(const RadianceImage& picture, int left, int top, PixelPoint smear = {},
                           double move_x = 0.0, double move_y = 0.0, int threads = 1) {
  WorkerPool pool(threads);
  const std::vector<float> table = gaussian_table();
  GridOtf otf(1.0 / kStep, 1, kStep * kSamples);
  otf.prepare(RadialOtf{table, 4096.0 / 1.4}, kStep * kSamples, {smear, {}});
  Blur blur(kSamples, kStep, pool);
  blur.transform(picture, {kStep * kSamples, kStep * kSamples, left, top}, otf);
  blur.sample(move_x, move_y);
  std::vector<float> out;
  for (int y = 0; y < kSamples; ++y)
    for (const float x : blur.row(y)) out.push_back(static_cast<float>(blur.scale()) * x);
  return out;
}

/// Patches that no lane of four and no group of rows is blind to.
RadianceImage patches() {
  RadianceImage picture(37, 26);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      picture.at(x, y) =
          static_cast<float>((x * 7 + y * 13) % 11) + (x == 20 && y == 9 ? 50.0F : 0.0F);
  return picture;
}

double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, static_cast<double>(std::abs(a[i] - b[i])));
  return most;
}

TEST(Blur, IsTheSumOfWhatEachCellSpreads) {
  // In real space: cells are points, and the pixel's square with a cell's taken out is three points
  // a third of a pixel apart, whose transform is sinc(f) / sinc(f / 3) exactly.
  const RadianceImage picture = patches();
  const std::vector<float> got = blurred(picture, 70, 81);
  double worst = 0;
  for (int y = 0; y < kSamples; ++y) {
    for (int x = 0; x < kSamples; ++x) {
      double want = 0;
      for (int j = 0; j < picture.height(); ++j) {
        for (int i = 0; i < picture.width(); ++i) {
          const auto share = [](double distance_px) {
            double sum = 0;
            for (const double third : {-1.0 / 3.0, 0.0, 1.0 / 3.0}) {
              const double d = distance_px + third;
              sum += std::exp(-0.5 * d * d / (kSigma_px * kSigma_px)) /
                     (std::sqrt(2.0 * kPi) * kSigma_px) / 9.0;
            }
            return sum;
          };
          want += static_cast<double>(picture.at(i, j)) * share((70.0 + i) / kStep - x) *
                  share((81.0 + j) / kStep - y);
        }
      }
      worst = std::max(
          worst,
          std::abs(static_cast<double>(got[static_cast<std::size_t>(y * kSamples + x)]) - want));
    }
  }
  // Values up to 12; single precision of some 60 000 waves.
  EXPECT_LT(worst, 12.0 * 2e-6);
}

TEST(Blur, MovesAsThePictureDoes) {
  const RadianceImage picture = patches();
  // By whole cells, and by a part and back.
  EXPECT_LT(largest_difference(blurred(picture, 70, 81, {}, 5.0, -2.0), blurred(picture, 75, 79)),
            3e-5);
  EXPECT_GT(largest_difference(blurred(picture, 70, 81, {}, 0.5, 0.0), blurred(picture, 70, 81)),
            1e-2);
}

TEST(Blur, ASmearIsTheMeanOverItsLength) {
  const RadianceImage picture = patches();
  const std::vector<float> got = blurred(picture, 70, 81, {4.0, -2.0});
  std::vector<float> mean(got.size(), 0.0F);
  constexpr int kPlaces = 48;
  for (int i = 0; i < kPlaces; ++i) {
    const double t = (i + 0.5) / kPlaces - 0.5;
    const auto moved = blurred(picture, 70, 81, {}, kStep * 4.0 * t, kStep * -2.0 * t);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += moved[k] / kPlaces;
  }
  // Midpoints a tenth of a pixel apart: (pi f / 10)^2 / 24 of waves up to half a cycle per pixel.
  EXPECT_LT(largest_difference(got, mean), 12.0 * 1.2e-3);
}

TEST(Blur, GivesTheSameBitsOnAnyNumberOfThreads) {
  const RadianceImage picture = patches();
  const std::vector<float> one = blurred(picture, 33, 41, {2.0, 1.0}, 0.3, 0.4);
  EXPECT_EQ(one, blurred(picture, 33, 41, {2.0, 1.0}, 0.3, 0.4, 2));
  EXPECT_EQ(one, blurred(picture, 33, 41, {2.0, 1.0}, 0.3, 0.4, 3));
}

}  // namespace
}  // namespace engine
