#include "engine/detector/noise_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace engine {
namespace {

using noise_lanes::Counts;
using noise_lanes::Means;
using noise_lanes::Place;

constexpr std::uint64_t kSeed = 0x123456789ABCDEFULL;
constexpr std::uint64_t kFrame = 0x1122334455667788ULL;

/// Light is the mean itself.
Means plain() {
  Means means;
  means.e_per_w_m2 = 1.0F;
  means.full_well_e = 1e9F;
  means.brim_e = 1e9F;
  return means;
}

/// The w with P(W <= w) = share for share <= 1/2, by Newton's method from the tail's own figures.
double quantile(double share) {
  double w = share > 0.1 ? 0.0 : -std::sqrt(-2.0 * std::log(share));
  for (int i = 0; i < 60; ++i) {
    const double off = 0.5 * std::erfc(-w / std::sqrt(2.0)) - share;
    w -= std::clamp(off / (std::exp(-0.5 * w * w) / std::sqrt(2.0 * std::acos(-1.0))), -0.5, 0.5);
  }
  return w;
}

TEST(NoiseLanes, WordsAreDrawsInTheMapThatIsWrittenDown) {
  std::vector<std::uint32_t> words(64 * 7);
  const Place place{kSeed, kFrame, 64 * 1000};
  noise_lanes::words(place, Stream::kShot, words);
  for (std::uint32_t i = 0; i < words.size(); ++i) {
    const std::uint32_t pixel = place.first + i;
    const auto block = Draws(kSeed, Stream::kShot, kFrame, pixel / 64 * 16 + pixel % 16).block();
    ASSERT_EQ(words[i], block[pixel % 64 / 16]) << i;
  }
}

TEST(NoiseLanes, NormalsAreTheQuantileAtEveryScaleOfTheTail) {
  std::vector<std::uint32_t> words;
  for (int bit = 0; bit < 31; ++bit)
    for (std::uint32_t part = 0; part < 16; ++part)
      words.push_back((1U << bit) + ((1U << bit) >> 4) * part);
  words.push_back(0);
  for (std::uint32_t i = 0; words.size() < 64 * 64; ++i) words.push_back(i * 1048583U % (1U << 31));
  std::vector<float> low(words.size());
  noise_lanes::normals_of(words, low);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const double want = quantile((words[i] + 0.5) * 0x1p-32);
    // Polynomials to 2e-6 of the value, and what single precision leaves of 1 - 2 u.
    ASSERT_NEAR(static_cast<double>(low[i]), want, 2e-6 * std::abs(want) + 1.5e-7) << words[i];
    ASSERT_LT(std::abs(low[i]), noise_lanes::kLargestNormal);
  }
  // The other half is the mirror image, bit for bit.
  std::vector<std::uint32_t> mirrored(words.size());
  std::transform(words.begin(), words.end(), mirrored.begin(), [](std::uint32_t w) { return ~w; });
  std::vector<float> high(words.size());
  noise_lanes::normals_of(mirrored, high);
  for (std::size_t i = 0; i < words.size(); ++i) ASSERT_EQ(high[i], -low[i]) << words[i];
}

/// Everything that comes out, of means of all sizes, rows of one mean, and what is no light.
struct AllOfIt {
  std::vector<float> electrons = std::vector<float>(64 * 513 + 17);
  std::vector<float> normals = std::vector<float>(64 * 64);
  std::vector<std::uint16_t> dn = std::vector<std::uint16_t>(electrons.size());
  Counts counts;
};

AllOfIt all_of_it() {
  AllOfIt all;
  std::vector<float> light(all.electrons.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double x = 0.618033988749895 * static_cast<double>(i / 64 % 2 == 0 ? i : i / 64);
    light[i] = static_cast<float>(std::exp(-14.0 + 30.0 * (x - std::floor(x))));
  }
  light[100] = std::numeric_limits<float>::quiet_NaN();
  light[200] = std::numeric_limits<float>::infinity();
  light[300] = -1.0F;
  Means means = plain();
  means.full_well_e = 1e5F;
  all.counts = noise_lanes::expose({kSeed, kFrame, 640}, means, light, all.electrons);
  noise_lanes::digitize({kSeed, kFrame, 640}, {2.0F, 0.5F, 20.5F, 2047.0F}, all.electrons, all.dn);
  noise_lanes::normals({kSeed, kFrame, 640}, Stream::kRead, all.normals);
  return all;
}

TEST(NoiseLanes, GiveTheSameBitsOnEveryKindOfProcessor) {
  const AllOfIt want = all_of_it();
  EXPECT_EQ(want.counts.no_light_px, 2);
  EXPECT_GT(want.counts.full_well_px, 100);
  int targets = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    const AllOfIt got = all_of_it();
    EXPECT_EQ(got.electrons, want.electrons) << hwy::TargetName(target);
    EXPECT_EQ(got.normals, want.normals) << hwy::TargetName(target);
    EXPECT_EQ(got.dn, want.dn) << hwy::TargetName(target);
    EXPECT_EQ(got.counts.no_light_px, want.counts.no_light_px) << hwy::TargetName(target);
    EXPECT_EQ(got.counts.full_well_px, want.counts.full_well_px) << hwy::TargetName(target);
    ++targets;
  }
  hwy::SetSupportedTargetsForTest(0);
  EXPECT_GE(targets, 2);
}

TEST(NoiseLanes, APixelIsTheSameHoweverTheFrameIsCut) {
  std::vector<float> light(64 * 20);
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = static_cast<float>(i % 97) * 0.3F;
  std::vector<float> response(light.size(), 0.5F);
  std::vector<float> dark(light.size(), 3.0F);
  Means means = plain();
  means.exposure_s = 2.0F;
  means.response = response;
  means.dark_e_s = dark;
  std::vector<float> whole(light.size());
  noise_lanes::expose({1, 2, 0}, means, light, whole);
  for (const std::size_t begin : {0U, 64U, 640U}) {
    for (const std::size_t size : {1U, 63U, 64U, 65U, 200U}) {
      std::vector<float> part(size);
      means.response = std::span(response).subspan(begin, size);
      means.dark_e_s = std::span(dark).subspan(begin, size);
      noise_lanes::expose({1, 2, static_cast<std::uint32_t>(begin)}, means,
                          std::span(light).subspan(begin, size), part);
      EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin() + static_cast<long>(begin)))
          << begin << " " << size;
    }
  }
}

TEST(NoiseLanes, AFrameOfOneMeanHasTheBitsOfThatMeanAmongOthers) {
  for (const float mean : {0.0F, 1e-3F, 0.5F, 7.9F, 8.0F, 12.5F, 1e4F}) {
    std::vector<float> even(64 * 64, mean);
    std::vector<float> mixed = even;
    for (std::size_t i = 0; i < mixed.size(); i += 5) mixed[i] = static_cast<float>(i);
    std::vector<float> from_even(even.size());
    std::vector<float> from_mixed(even.size());
    noise_lanes::expose({1, 2, 0}, plain(), even, from_even);
    noise_lanes::expose({1, 2, 0}, plain(), mixed, from_mixed);
    for (std::size_t i = 0; i < even.size(); ++i) {
      if (i % 5 == 0) continue;
      ASSERT_EQ(from_even[i], from_mixed[i]) << mean << " " << i;
    }
  }
}

TEST(NoiseLanes, CountEachPixelOnce) {
  for (const std::size_t size : {64U, 70U, 640U, 1000U}) {
    std::vector<float> light(size, 500.0F);
    light[3] = std::numeric_limits<float>::quiet_NaN();
    light[size - 1] = -2.0F;
    light[size - 2] = 1e8F;
    light[5] = std::numeric_limits<float>::infinity();
    Means means = plain();
    means.full_well_e = 1e4F;
    for (const bool clip : {true, false}) {
      means.clip = clip;
      std::vector<float> electrons(size);
      const Counts counts = noise_lanes::expose({1, 2, 0}, means, light, electrons);
      EXPECT_EQ(counts.no_light_px, 2) << size;
      EXPECT_EQ(counts.full_well_px, 2) << size;
      EXPECT_EQ(electrons[5], clip ? 1e4F : 1e9F);
      EXPECT_EQ(electrons[3], 0.0F);
      if (!clip) {
        EXPECT_NEAR(static_cast<double>(electrons[size - 2]), 1e8, 7e4);  // 7 sigma
      }
    }
  }
}

}  // namespace
}  // namespace engine
