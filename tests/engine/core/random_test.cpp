#include "engine/core/random.h"

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::Moments;

TEST(Draws, AreThePublishedPhilox) {
  // Random123's known answer for key 0 and counter 0; the seed takes the stream back out of the
  // key.
  constexpr std::uint64_t kNoKey = std::uint64_t{0x9E3779B9U} << 32;
  Draws draws(kNoKey, Stream::kLight, 0, 0);
  const std::array<std::uint32_t, 4> want{0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U};
  EXPECT_EQ(draws.block(), want);
  Draws one_by_one(kNoKey, Stream::kLight, 0, 0);
  for (const std::uint32_t word : want) EXPECT_EQ(one_by_one.bits(), word);
}

TEST(Draws, AreAFunctionOfSeedStreamFrameAndPlace) {
  const auto first = [](std::uint64_t seed, Stream stream, std::uint64_t frame,
                        std::uint32_t place) { return Draws(seed, stream, frame, place).block(); };
  EXPECT_EQ(first(1, Stream::kShot, 2, 3), first(1, Stream::kShot, 2, 3));
  std::set<std::array<std::uint32_t, 4>> all;
  int count = 0;
  for (const std::uint64_t seed : {0ULL, 1ULL, 1ULL << 32, 1ULL << 63}) {
    for (const Stream stream :
         {Stream::kLight, Stream::kShot, Stream::kShotDetail, Stream::kRead}) {
      for (const std::uint64_t frame : {0ULL, 1ULL, 1ULL << 32}) {
        for (const std::uint32_t place : {0U, 1U, 0xFFFFFFFFU}) {
          all.insert(first(seed, stream, frame, place));
          ++count;
        }
      }
    }
  }
  EXPECT_EQ(all.size(), static_cast<std::size_t>(count));
}

TEST(Draws, UniformsFillTheOpenUnitInterval) {
  constexpr int kDraws = 1 << 20;
  Draws draws(1, Stream::kLight, 0, 0);
  Moments single;
  Moments wide;
  std::vector<double> observed(64, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const float x = draws.uniform();
    ASSERT_GT(x, 0.0F);
    ASSERT_LT(x, 1.0F);
    observed[static_cast<std::size_t>(x * 64.0F)] += 1.0;
    single.add(static_cast<double>(x));
    const double y = draws.uniform_double();
    ASSERT_TRUE(y > 0.0 && y < 1.0);
    wide.add(y);
  }
  const double sigma = std::sqrt(1.0 / 12.0 / kDraws);
  EXPECT_NEAR(single.mean(), 0.5, 4.5 * sigma);
  EXPECT_NEAR(wide.mean(), 0.5, 4.5 * sigma);
  // The variance of (x - 1/2)^2 is 1/180.
  EXPECT_NEAR(wide.variance(), 1.0 / 12.0, 4.5 * std::sqrt(1.0 / 180.0 / kDraws));
  const std::vector<double> expected(64, kDraws / 64.0);
  EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4);
}

TEST(Draws, NormalsAreNormal) {
  constexpr int kDraws = 1 << 20;
  Draws draws(2, Stream::kRead, 0, 0);
  Moments moments;
  std::vector<double> observed(100, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const double x = static_cast<double>(draws.normal());
    ASSERT_LT(std::abs(x), static_cast<double>(Draws::kLargestNormal));
    moments.add(x);
    observed[static_cast<std::size_t>((x + 6.5) / 13.0 * 100.0)] += 1.0;
  }
  EXPECT_NEAR(moments.mean(), 0.0, 4.5 / std::sqrt(kDraws));
  EXPECT_NEAR(moments.variance(), 1.0, 4.5 * std::sqrt(2.0 / kDraws));
  std::vector<double> expected(100);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto edge = [](std::size_t k) {
      return 0.5 * std::erfc(-(static_cast<double>(k) * 0.13 - 6.5) / std::sqrt(2.0));
    };
    expected[i] = kDraws * (edge(i + 1) - edge(i));
  }
  EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4);
}

TEST(Draws, PoissonHasItsMeanVarianceAndShape) {
  struct Case {
    double mean;
    std::uint32_t draws;
  };
  // Both methods, and both sides of the change between them; enough draws to see the rarest.
  for (const Case& c :
       {Case{1e-6, 20000000}, Case{0.1, 1000000}, Case{1.0, 1000000}, Case{11.999, 1000000},
        Case{12.001, 1000000}, Case{100.0, 1000000}, Case{1e4, 1000000}}) {
    Moments moments;
    const auto largest = static_cast<std::size_t>(c.mean + 12.0 * std::sqrt(c.mean) + 20.0);
    std::vector<double> observed(largest + 1, 0.0);
    for (std::uint32_t i = 0; i < c.draws; ++i) {
      Draws draws(3, Stream::kShot, 0, i);
      const double k = draws.poisson(c.mean);
      moments.add(k);
      observed[std::min(static_cast<std::size_t>(k), largest)] += 1.0;
    }
    const auto n = static_cast<double>(c.draws);
    EXPECT_NEAR(moments.mean(), c.mean, 5.0 * std::sqrt(c.mean / n)) << c.mean;
    EXPECT_NEAR(moments.variance(), c.mean, 5.0 * std::sqrt((c.mean + 2.0 * c.mean * c.mean) / n))
        << c.mean;
    std::vector<double> expected(largest + 1, 0.0);
    for (std::size_t k = 0; k <= largest; ++k) {
      int sign = 1;
      const auto x = static_cast<double>(k);
      expected[k] = n * std::exp(x * std::log(c.mean) - c.mean - ::lgamma_r(x + 1.0, &sign));
    }
    EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4) << c.mean;
  }
}

TEST(Draws, PoissonOfAGreatMeanIsNormal) {
  for (const double mean : {1e6, 0.999e9, 1.001e9, 1e12}) {
    Moments moments;
    for (std::uint32_t i = 0; i < 100000; ++i) {
      Draws draws(4, Stream::kShot, 0, i);
      moments.add((draws.poisson(mean) - mean) / std::sqrt(mean));
    }
    EXPECT_NEAR(moments.mean(), 0.0, 5.0 / std::sqrt(1e5)) << mean;
    EXPECT_NEAR(moments.variance(), 1.0, 5.0 * std::sqrt(2.0 / 1e5)) << mean;
  }
}

TEST(Draws, PoissonOfNoLightIsZero) {
  Draws draws(5, Stream::kShot, 0, 0);
  for (const double mean : {0.0, -1.0, -1e300, std::nan(""), 1e-300})
    EXPECT_EQ(draws.poisson(mean), 0.0) << mean;
  EXPECT_EQ(Draws::poisson_from(1e-17, 5.0), 0.0);
  EXPECT_LE(Draws::poisson_from(1.0 - 0x1p-53, 11.999), 200.0);
}

TEST(Draws, FramesAreUncorrelated) {
  // A generator seeded with the frame's number shows .5 here; 4 sigma of 1e5 frames are .013.
  std::vector<double> first;
  for (std::uint64_t frame = 0; frame < 100000; ++frame) {
    Draws draws(6, Stream::kRead, frame, 12345);
    first.push_back(static_cast<double>(draws.uniform()));
  }
  for (const std::size_t lag : {1U, 2U, 3U, 4U, 5U}) {
    EXPECT_LT(std::abs(test_support::correlation(std::span(first).first(first.size() - lag),
                                                 std::span(first).subspan(lag))),
              4.0 / std::sqrt(1e5))
        << lag;
  }
}

}  // namespace
}  // namespace engine
