#include "engine/detector/poisson_tail.h"

#include <cmath>

#include <gtest/gtest.h>

namespace engine {
namespace {

/// P(X <= k) or P(X > k), summed from its smallest term on.
long double share(double k, long double mean, bool below) {
  int sign = 1;
  const auto term = [&](long double j) {
    return std::exp(j * std::log(mean) - mean - ::lgammal_r(j + 1.0L, &sign));
  };
  long double sum = 0;
  const long double reach = std::floor(60.0L * std::sqrt(mean)) + 200.0L;
  if (below) {
    for (long double j = std::max(0.0L, k - reach); j <= k; j += 1.0L) sum += term(j);
  } else {
    for (long double j = k + reach; j > k; j -= 1.0L) sum += term(j);
  }
  return sum;
}

TEST(PoissonTail, IsTheLeastCountWhoseShareReachesTheUniformNumber) {
  for (const double mean : {1e-6, 1e-3, 0.035, 1.0, 7.9, 8.0, 30.0, 1e3, 1e5, 1e6}) {
    for (const double detail : {1e-9, 0.3, 0.999}) {
      for (const std::uint32_t near : {0U, 1U, 77U, 57000U, 1000000U}) {
        for (const bool low : {true, false}) {
          const std::uint32_t word = low ? near : ~near;
          const long double wanted = (low ? near + static_cast<long double>(detail)
                                          : near + (1.0L - static_cast<long double>(detail))) *
                                     0x1p-32L;
          const double k = poisson_tail(word, detail, mean);
          ASSERT_EQ(k, std::floor(k));
          // Whole counts: the figures of double need not be better than the steps are wide.
          constexpr long double kRounding = 1e-7L;
          if (low) {
            EXPECT_GE(share(k, mean, true) * (1 + kRounding), wanted) << mean << " " << word;
            if (k > 0.0) {
              EXPECT_LT(share(k - 1.0, mean, true) * (1 - kRounding), wanted)
                  << mean << " " << word;
            }
          } else {
            EXPECT_LE(share(k, mean, false) * (1 - kRounding), wanted) << mean << " " << word;
            if (k > 0.0) {
              EXPECT_GT(share(k - 1.0, mean, false) * (1 + kRounding), wanted)
                  << mean << " " << word;
            }
          }
        }
      }
    }
  }
}

TEST(PoissonTail, GoesOnWithoutAStepWhereSumsEnd) {
  for (const std::uint32_t word : {5U, 50000U, 0xFFFFFFF0U, 0xFFFFFF00U}) {
    const double below = poisson_tail(word, 0.5, 2e6);
    const double above = poisson_tail(word, 0.5, 2e6 + 1.0);
    // .0005 sigma, 0.7 e-, by either quantile; whole counts, and 1 e- between the means.
    EXPECT_NEAR(above - below, 1.0, 3.0) << word;
  }
}

}  // namespace
}  // namespace engine
