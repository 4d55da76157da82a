#include "engine/render/sobol.h"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/sample_lanes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::Moments;
using Pair = std::array<float, 2>;
using PointOf = std::function<Pair(std::uint32_t)>;

/// Of 2^k points every elementary interval of area 2^-k, of whatever shape, holds one.
void expect_net(const PointOf& point, std::uint32_t first, unsigned k) {
  for (unsigned a = 0; a <= k; ++a) {
    const unsigned columns = 1U << a;
    const unsigned rows = 1U << (k - a);
    std::vector<int> held(std::size_t{columns} * rows, 0);
    for (std::uint32_t i = first; i < first + (1U << k); ++i) {
      const Pair p = point(i);
      ASSERT_TRUE(p[0] > 0.0F && p[0] < 1.0F && p[1] > 0.0F && p[1] < 1.0F);
      const auto column = static_cast<std::size_t>(p[0] * static_cast<float>(columns));
      const auto row = static_cast<std::size_t>(p[1] * static_cast<float>(rows));
      ++held[row * columns + column];
    }
    for (const int n : held) ASSERT_EQ(n, 1) << k << " " << a;
  }
}

TEST(Sobol, ScrambledPlacesAreANet) {
  for (std::uint32_t key = 0; key < 20; ++key) {
    const PlaceSequence places(SequenceKind::kSobol, key * 0x12345679U);
    const auto point = [&](std::uint32_t i) { return places.at(i); };
    for (unsigned k = 0; k <= 9; ++k)
      for (std::uint32_t block = 0; block < 3; ++block) expect_net(point, block << k, k);
  }
}

TEST(Sobol, ScrambledAndReorderedPairsAreANet) {
  for (std::uint32_t key = 0; key < 10; ++key) {
    for (const std::uint32_t number : {0U, 1U, 5U, 66U}) {
      const auto point = [&](std::uint32_t i) {
        return SampleNumbers(SequenceKind::kSobol, key * 0x9876543U, i).pair(number);
      };
      for (unsigned k = 0; k <= 8; ++k) expect_net(point, 0, k);
    }
  }
}

TEST(Sobol, EachPointIsEvenOverTheSquareAndOverTheKeys) {
  // 16 x 16 bins of one point over 100 000 keys.
  for (const SequenceKind kind : {SequenceKind::kSobol, SequenceKind::kIndependent}) {
    for (const std::uint32_t sample : {0U, 1U, 6U, 53U}) {
      std::vector<double> places(256);
      std::vector<double> pairs(256);
      constexpr std::uint32_t kKeys = 100000;
      for (std::uint32_t i = 0; i < kKeys; ++i) {
        const auto key = static_cast<std::uint32_t>(mixed(i));
        const auto bin = [](const Pair& p) {
          return static_cast<std::size_t>(p[0] * 16.0F) * 16 +
                 static_cast<std::size_t>(p[1] * 16.0F);
        };
        ++places[bin(PlaceSequence(kind, key).at(sample))];
        ++pairs[bin(SampleNumbers(kind, key, sample).pair(3))];
      }
      const std::vector<double> even(256, kKeys / 256.0);
      EXPECT_GT(test_support::histogram_p(places, even), 1e-4) << sample;
      EXPECT_GT(test_support::histogram_p(pairs, even), 1e-4) << sample;
    }
  }
}

TEST(Sobol, PairsOfASampleKnowNothingOfEachOther) {
  constexpr std::size_t kKeys = 100000;
  for (const SequenceKind kind : {SequenceKind::kSobol, SequenceKind::kIndependent}) {
    std::array<std::vector<double>, 6> numbers;
    for (std::uint32_t i = 0; i < kKeys; ++i) {
      const auto key = static_cast<std::uint32_t>(mixed(i));
      const SampleNumbers sample(kind, key, 5);
      const std::array<Pair, 3> pairs{PlaceSequence(kind, key).at(5), sample.pair(1),
                                      sample.pair(2)};
      for (std::size_t k = 0; k < 6; ++k)
        numbers[k].push_back(static_cast<double>(pairs[k / 2][k % 2]));
    }
    // 1/sqrt(keys) is one sigma; fifteen pairs.
    for (std::size_t a = 0; a < 6; ++a)
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_LT(std::abs(test_support::correlation(numbers[a], numbers[b])),
                  4.5 / std::sqrt(1.0 * kKeys))
            << a << " " << b;
  }
}

/// The share of n points on one side of an edge at an angle of 30 deg, over keys.
Moments edge(SequenceKind kind, std::uint32_t n, double off) {
  Moments shares;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const PlaceSequence places(kind, static_cast<std::uint32_t>(mixed(i)));
    double inside = 0;
    for (std::uint32_t k = 0; k < n; ++k) {
      const Pair p = places.at(k);
      const double along = (static_cast<double>(p[0]) - 0.5) * std::cos(kPi / 6) +
                           (static_cast<double>(p[1]) - 0.5) * std::sin(kPi / 6);
      inside += along < off ? 1.0 : 0.0;
    }
    shares.add(inside / n);
  }
  return shares;
}

TEST(Sobol, BothSequencesAgreeInTheMeanAndStratificationShowsInTheVariance) {
  for (const std::uint32_t n : {16U, 64U, 256U}) {
    for (const double off : {0.0, 0.13}) {
      const Moments even = edge(SequenceKind::kSobol, n, off);
      const Moments chance = edge(SequenceKind::kIndependent, n, off);
      const double noise = std::hypot(even.sigma_of_mean(), chance.sigma_of_mean());
      EXPECT_NEAR(even.mean(), chance.mean(), 4.0 * noise) << n;
      // An edge crosses 2 sqrt(n) of n squares at most; each adds p (1 - p) / n^2, 1/6 on average.
      const double share = chance.mean() * (1.0 - chance.mean());
      const double stratified = 2.0 * std::sqrt(1.0 * n) / 6.0 / (1.0 * n * n);
      EXPECT_LT(even.variance(), 1.15 * stratified) << n;  // 4000 keys know it to 2.2 %
      EXPECT_NEAR(chance.variance() / (share / n), 1.0, 0.12) << n;
    }
  }
}

TEST(SampleLanes, AreTheSameBitsAsOneByOne) {
  SampleLanes::Words keys;
  SampleLanes::Words samples;
  for (std::uint32_t round = 0; round < 100; ++round) {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      keys[i] = static_cast<std::uint32_t>(mixed(round * 16 + i));
      samples[i] = keys[i] >> (round % 32);
    }
    for (const SequenceKind kind : {SequenceKind::kSobol, SequenceKind::kIndependent}) {
      SampleLanes places;
      SampleLanes pairs;
      places.places(kind, keys, samples);
      pairs.pairs(kind, keys, samples, round);
      for (std::size_t i = 0; i < keys.size(); ++i) {
        const Pair place = PlaceSequence(kind, keys[i]).at(samples[i]);
        const Pair pair = SampleNumbers(kind, keys[i], samples[i]).pair(round);
        ASSERT_EQ(places.first[i], place[0]);
        ASSERT_EQ(places.second[i], place[1]);
        ASSERT_EQ(pairs.first[i], pair[0]);
        ASSERT_EQ(pairs.second[i], pair[1]);
      }
    }
  }
}

TEST(SampleLanes, LookTowardsTheSamePlacesOfALamp) {
  const Lamp lamp{{Eigen::Vector3d(0.3, -0.5, 0.7).normalized()}, 600.0};
  for (const double radius_rad : {kSunAngularRadius_rad, 0.5, 1.5}) {
    const LampCone cone(lamp, radius_rad);
    for (std::uint32_t round = 0; round < 200; ++round) {
      SampleLanes lanes;
      for (std::size_t i = 0; i < SampleLanes::kLanes; ++i) {
        lanes.first[i] = fraction(static_cast<std::uint32_t>(mixed(round * 32 + i)));
        lanes.second[i] = fraction(static_cast<std::uint32_t>(mixed(round * 32 + 16 + i)));
      }
      RayPacket rays;
      lanes.towards(cone, rays);
      for (std::size_t i = 0; i < SampleLanes::kLanes; ++i) {
        const Eigen::Vector3f one = cone.sample({lanes.first[i], lanes.second[i]});
        const Eigen::Vector3f many(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
        ASSERT_LT((one - many).norm(), 1e-6F);  // some roundings of a float
        ASSERT_NEAR(many.norm(), 1.0F, 1e-6F);
        ASSERT_GT(cone.density(many.cast<double>() * 1.0), 0.0) << radius_rad;
      }
    }
  }
}

}  // namespace
}  // namespace engine
