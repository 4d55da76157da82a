#include "tools/quality/image_quality.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace {

using engine::DnImage;
using quality::ImageQuality;
using quality::Verdict;

constexpr double kPi = engine::kPi;

/// Rounded to the nearest DN and clipped as a converter of 11 bits does.
std::uint16_t digitised(double dn) {
  return static_cast<std::uint16_t>(std::clamp(std::floor(dn + 0.5), 0.0, 2047.0));
}

/// A picture that is a function of the place, in normal noise.
DnImage picture(int size_px, const std::function<double(double u, double v)>& dn, double sigma_dn,
                std::uint64_t seed = 1) {
  std::mt19937_64 chance(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  DnImage image(size_px, size_px);
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u)
      image.at(u, v) = digitised(dn(u, v) + sigma_dn * normal(chance));
  return image;
}

/// The share of a step at 0 that a Gaussian has moved to here.
double step(double x, double sigma) { return 0.5 * std::erfc(-x / (sigma * std::sqrt(2.0))); }

/// A square of the side 80 px, turned, its edges blurred by a Gaussian.
std::function<double(double, double)> square(double blur_px, double turned_deg, double height_dn) {
  return [=](double u, double v) {
    const double c = std::cos(turned_deg * engine::kDegree);
    const double s = std::sin(turned_deg * engine::kDegree);
    const double x = (u - 128.3) * c + (v - 127.6) * s;
    const double y = (v - 127.6) * c - (u - 128.3) * s;
    return 20.0 + height_dn * step(40.0 - std::abs(x), blur_px) * step(40.0 - std::abs(y), blur_px);
  };
}

std::function<double(double, double)> spot(double blur_px, double light_dn, double u0 = 64.2,
                                           double v0 = 63.7) {
  return [=](double u, double v) {
    const double r2 = (u - u0) * (u - u0) + (v - v0) * (v - v0);
    return 20.0 +
           light_dn / (2.0 * kPi * blur_px * blur_px) * std::exp(-0.5 * r2 / (blur_px * blur_px));
  };
}

ImageQuality quality_of(const DnImage& image, double e_per_dn = 0) {
  return quality::Meter(image.width(), image.height()).measure(image, {2047, e_per_dn});
}

void expect_finite(const ImageQuality& q) {
  for (const double figure : {q.background_dn, q.noise_dn.value_or(0), q.contrast_dn,
                              q.contrast_sigma, q.sharpness.value_or(0), q.edge_px.value_or(0),
                              q.place_px.value_or(0), q.score_db.value_or(0)})
    EXPECT_TRUE(std::isfinite(figure));
  EXPECT_EQ(q.score_db.has_value(), q.verdict == Verdict::kMeasured);
  EXPECT_GE(q.sharpness.value_or(0.0), 0.0);
  EXPECT_LE(q.sharpness.value_or(0.0), 1.0);
}

class NoiseSigma : public testing::TestWithParam<double> {};

TEST_P(NoiseSigma, IsFoundThroughRoundingWhereverTheLevelLies) {
  const double sigma = GetParam();
  for (const double level : {20.0, 20.25, 20.5, 20.8}) {
    const auto q = quality_of(picture(
        512, [=](double, double) { return level; }, sigma));
    ASSERT_TRUE(q.noise_dn) << level;
    // 2.6e5 pixels, of which the narrowest noise leaves a tail of 10 to 100: 3 % of a quantile.
    EXPECT_NEAR(*q.noise_dn, sigma, 0.02 * sigma) << level;
    EXPECT_NEAR(q.background_dn, level, 0.02 * sigma) << level;
    EXPECT_EQ(q.verdict, Verdict::kNothing);
  }
}

INSTANTIATE_TEST_SUITE_P(ImageQuality, NoiseSigma, testing::Values(0.3, 0.4, 0.7, 1.0, 3.0, 7.0));

TEST(ImageQuality, NoiseUnderAFifthOfADnIsBoundedNotMeasured) {
  for (const double sigma : {0.02, 0.05, 0.1, 0.15}) {
    for (const double level : {20.0, 20.3, 20.5}) {
      const auto q = quality_of(picture(
          512, [=](double, double) { return level; }, sigma));
      // Two DN at most have all but a few pixels: half a DN is 2.2 sigma or more.
      EXPECT_LE(q.noise_dn.value_or(0.0), 0.23) << sigma << ' ' << level;
    }
  }
}

TEST(ImageQuality, NoiseClippedAtZeroKeepsItsSigma) {
  const auto q = quality_of(picture(
      512, [](double, double) { return 0.0; }, 2.0));
  ASSERT_TRUE(q.noise_dn);
  EXPECT_NEAR(*q.noise_dn, 2.0, 0.05);
}

TEST(ImageQuality, StarsDoNotChangeTheNoise) {
  std::mt19937_64 chance(4);
  std::uniform_real_distribution<double> place(5.0, 507.0);
  DnImage image = picture(
      512, [](double, double) { return 20.3; }, 0.4);
  for (int star = 0; star < 400; ++star) {
    const int u = static_cast<int>(place(chance));
    const int v = static_cast<int>(place(chance));
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        image.at(u + i, v + j) = static_cast<std::uint16_t>(image.at(u + i, v + j) + 30);
  }
  const auto q = quality_of(image);
  ASSERT_TRUE(q.noise_dn);
  EXPECT_NEAR(*q.noise_dn, 0.4, 0.02);
}

TEST(ImageQuality, AnEdgesWidthIsFound) {
  for (const double blur_px : {0.5, 0.7, 1.0, 1.5, 2.0, 3.0}) {
    const auto q = quality_of(picture(256, square(blur_px, 0.0, 1000.0), 1.0));
    ASSERT_TRUE(q.edge_px) << blur_px;
    // The square's corners are a hundredth of its outline; at half a pixel the edge's place between
    // pixels shows.
    EXPECT_NEAR(*q.edge_px, blur_px, (blur_px < 0.7 ? 0.08 : 0.03) * blur_px);
  }
}

TEST(ImageQuality, AnEdgesWidthDependsOnItsDirectionByASeventhAtMost) {
  for (const double turned_deg : {10.0, 30.0, 45.0}) {
    for (const double blur_px : {0.7, 1.0, 2.0}) {
      const auto q = quality_of(picture(256, square(blur_px, turned_deg, 1000.0), 1.0));
      ASSERT_TRUE(q.edge_px);
      EXPECT_NEAR(*q.edge_px, blur_px, 0.14 * blur_px) << turned_deg;
    }
  }
}

TEST(ImageQuality, ASpotsPlaceIsTheBoundOfTheTheory) {
  // Of a Gaussian spot in white noise: var(u) = 8 pi s^4 noise^2 / light^2, twice for both axes;
  // differences over a pixel see less of it than gradients do, by 1 - 1 / (4 s^2) at most.
  for (const double blur_px : {2.0, 3.0}) {
    const double light_dn = 20000.0;
    const double noise2_dn2 = 4.0 + 1.0 / 12.0;
    const double place_px =
        std::sqrt(2.0 * 8.0 * kPi * std::pow(blur_px, 4) * noise2_dn2) / light_dn;
    const auto q = quality_of(picture(128, spot(blur_px, light_dn), 2.0));
    ASSERT_TRUE(q.place_px);
    EXPECT_NEAR(*q.place_px / place_px, 1.0 + 1.0 / (8.0 * blur_px * blur_px), 0.05);
    EXPECT_DOUBLE_EQ(*q.score_db, -20.0 * std::log10(*q.place_px));
  }
}

TEST(ImageQuality, NoiseAloneAddsNothingToAFaintSpotsPlace) {
  // A peak of thirty sigma, s = 3 px: J is 707 for each axis, and noise adds some 440 unless it is
  // taken out. One frame's J scatters by an eighth, the mean of 60 by 1.6 %; what lies beyond the
  // margin has 2 %.
  constexpr double kBlur_px = 3.0;
  constexpr double kSigma_dn = 4.0;
  const double noise_dn = std::sqrt(kSigma_dn * kSigma_dn + 1.0 / 12.0);
  const double light_dn = 30.0 * noise_dn * 2.0 * kPi * kBlur_px * kBlur_px;
  double j = 0;
  constexpr int kFrames = 60;
  for (int i = 0; i < kFrames; ++i) {
    const auto dn = [&](double u, double v) { return 30.0 + spot(kBlur_px, light_dn)(u, v); };
    const auto q = quality_of(picture(128, dn, kSigma_dn, static_cast<std::uint64_t>(i) + 1));
    ASSERT_TRUE(q.place_px);
    j += 2.0 / (*q.place_px * *q.place_px) / kFrames;
  }
  const double theory = std::pow(light_dn / noise_dn, 2) / (8.0 * kPi * std::pow(kBlur_px, 4));
  EXPECT_NEAR(j / theory, 1.0 - 1.0 / (4.0 * kBlur_px * kBlur_px), 0.07);
}

TEST(ImageQuality, PhotonsNoiseCountsOnceTheGainIsKnown) {
  const DnImage image = picture(256, square(1.0, 5.0, 1000.0), 1.0);
  const auto without = quality_of(image);
  const auto with = quality_of(image, 14.65);
  // Across an edge of blur 1 px, in steps of a hundredth: the gradients' power over the variance.
  double power_over_one = 0;
  double power_over_all = 0;
  for (double x = -6.0; x < 6.0; x += 0.01) {
    const double power = std::exp(-x * x);
    power_over_one += power / (1.0 + 1.0 / 12.0);
    power_over_all += power / (1.0 + 1.0 / 12.0 + 1000.0 * step(x, 1.0) / 14.65);
  }
  EXPECT_NEAR(*without.score_db - *with.score_db,
              10.0 * std::log10(power_over_one / power_over_all), 0.3);
}

TEST(ImageQuality, NeitherPlaceNorPedestalMatters) {
  const auto reference = quality_of(picture(256, square(1.0, 20.0, 500.0), 1.0));
  for (const double more_dn : {0.0, 17.0, 300.0}) {
    for (const int shift_px : {0, 1, 13}) {
      const auto dn = [=](double u, double v) {
        return square(1.0, 20.0, 500.0)(u - shift_px, v + shift_px) + more_dn;
      };
      const auto q = quality_of(picture(256, dn, 1.0, 7));
      EXPECT_NEAR(*q.score_db, *reference.score_db, 0.1) << more_dn << ' ' << shift_px;
      EXPECT_NEAR(*q.edge_px, *reference.edge_px, 0.02);
      EXPECT_NEAR(q.contrast_dn, reference.contrast_dn, 0.02 * reference.contrast_dn);
    }
  }
}

TEST(ImageQuality, AStarDoesNotTakeTheTargetsPlaceNorDoesTheEarthsLimb) {
  const auto scene = [](double u, double v) {
    const double limb = 800.0 * step(0.2 * u + v - 250.0, 1.0);
    return square(1.0, 20.0, 500.0)(u, v) + limb + spot(1.0, 3000.0, 30.0, 30.0)(u, v) - 20.0;
  };
  const auto alone = quality_of(picture(256, square(1.0, 20.0, 500.0), 1.0));
  const auto q = quality_of(picture(256, scene, 1.0));
  EXPECT_NEAR(*q.score_db, *alone.score_db, 0.1);
  EXPECT_NEAR(q.lit_px, alone.lit_px, 0.01 * alone.lit_px);
}

TEST(ImageQuality, NothingToMeasureIsSaidNotMade) {
  const auto even = [](std::uint16_t dn, int width, int height) {
    DnImage image(width, height);
    std::ranges::fill(image.pixels(), dn);
    return image;
  };
  for (const auto& [image, verdict] :
       std::vector<std::pair<DnImage, Verdict>>{{even(0, 64, 64), Verdict::kNothing},
                                                {even(20, 64, 64), Verdict::kNothing},
                                                {even(2047, 64, 64), Verdict::kFullScale},
                                                {even(2047, 1024, 1024), Verdict::kFullScale},
                                                {even(20, 1, 1), Verdict::kTooSmall},
                                                {even(2047, 1, 1), Verdict::kTooSmall},
                                                {DnImage(), Verdict::kTooSmall},
                                                {even(20, 7, 500), Verdict::kTooSmall},
                                                {even(20, 8, 8), Verdict::kNothing}}) {
    const ImageQuality q = quality_of(image);
    expect_finite(q);
    EXPECT_EQ(q.verdict, verdict) << image.width() << " x " << image.height();
    EXPECT_FALSE(sentence_of(q.verdict).empty());
  }
}

TEST(ImageQuality, LonePixelsAreNoTarget) {
  DnImage image = picture(
      256, [](double, double) { return 20.0; }, 0.4);
  for (int i = 0; i < 50; ++i) image.at(5 * i + 3, (37 * i) % 250) = 2047;
  const auto q = quality_of(image);
  EXPECT_EQ(q.verdict, Verdict::kNothing);
  EXPECT_NEAR(*q.noise_dn, 0.4, 0.02);
}

TEST(ImageQuality, IsFiniteWhateverTheFrame) {
  std::mt19937_64 chance(9);
  for (int i = 0; i < 300; ++i) {
    DnImage image(8 + static_cast<int>(chance() % 90), 8 + static_cast<int>(chance() % 90));
    const std::uint64_t most = 1 + chance() % 2048;
    const std::uint64_t rarely = 1 + chance() % 200;
    for (std::uint16_t& p : image.pixels())
      p = chance() % rarely == 0 ? static_cast<std::uint16_t>(chance() % most) : 0;
    expect_finite(quality_of(image, i % 2 == 0 ? 0.0 : 14.65));
  }
}

TEST(ImageQuality, PixelsBeyondFullScaleDoNoHarm) {
  DnImage image = picture(64, square(1.0, 0.0, 0.0), 1.0);
  for (int u = 20; u < 40; ++u)
    for (int v = 20; v < 40; ++v) image.at(u, v) = 65535;
  const auto q = quality_of(image, 14.65);
  expect_finite(q);
  EXPECT_EQ(q.saturated_px, 400);
}

TEST(ImageQuality, FramesNeedNotBeWholeTiles) {
  const DnImage whole = picture(300, square(1.0, 3.0, 500.0), 1.0);
  const ImageQuality reference = quality_of(whole);
  for (const int side_px : {241, 257, 258, 288}) {
    DnImage cut(side_px, side_px);
    for (int v = 0; v < side_px; ++v)
      for (int u = 0; u < side_px; ++u) cut.at(u, v) = whole.at(u, v);
    const ImageQuality q = quality_of(cut);
    EXPECT_NEAR(*q.noise_dn, *reference.noise_dn, 0.02) << side_px;
    EXPECT_NEAR(*q.score_db, *reference.score_db, 0.1) << side_px;
  }
}

TEST(ImageQuality, AMeterOfLargeFramesMeasuresSmallOnesAlike) {
  const DnImage small = picture(128, spot(2.0, 5000.0), 1.0);
  quality::Meter meter(1024, 1024);
  const auto large = meter.measure(picture(300, square(1.0, 3.0, 100.0), 1.0), {});
  EXPECT_EQ(large.verdict, Verdict::kMeasured);
  EXPECT_EQ(*meter.measure(small, {}).score_db, *quality_of(small).score_db);
}

}  // namespace
