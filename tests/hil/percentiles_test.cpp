#include "hil/percentiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace {

using hil::Percentiles;
using hil::percentiles_of;

/// `count`, ..., 2, 1.
std::vector<double> down_from(int count) {
  std::vector<double> values(static_cast<std::size_t>(count));
  std::iota(values.rbegin(), values.rend(), 1.0);
  return values;
}

TEST(Percentiles, OfOneToNAreTheRanksThemselves) {
  struct Case {
    int count;
    double p50, p99, p99_9;
  };
  for (const Case& c : {Case{1, 1, 1, 1},
                        {2, 1, 2, 2},
                        {3, 2, 3, 3},
                        {99, 50, 99, 99},
                        {100, 50, 99, 100},
                        {101, 51, 100, 101},
                        {1000, 500, 990, 999},
                        {1001, 501, 991, 1000},
                        {10000, 5000, 9900, 9990}}) {
    SCOPED_TRACE(c.count);
    const Percentiles p = percentiles_of(down_from(c.count));
    EXPECT_EQ(p.count, static_cast<std::size_t>(c.count));
    EXPECT_EQ(p.p50, c.p50);
    EXPECT_EQ(p.p99, c.p99);
    EXPECT_EQ(p.p99_9, c.p99_9);
    EXPECT_EQ(p.max, c.count);
  }
}

TEST(Percentiles, AreTheSmallestValuesThatEnoughOthersDoNotExceed) {
  // The definition, counted out on values with many ties: 17 different ones.
  std::vector<double> values;
  for (int i = 0; i < 5000; ++i) values.push_back(std::fmod(i * 7919.0, 17.0) - 5.0);
  const auto share_up_to = [&](double x) {
    return static_cast<double>(
               std::count_if(values.begin(), values.end(), [&](double v) { return v <= x; })) /
           static_cast<double>(values.size());
  };
  const Percentiles p = percentiles_of(values);
  for (const auto& [figure, share] :
       {std::pair(p.p50, 0.5), std::pair(p.p99, 0.99), std::pair(p.p99_9, 0.999)}) {
    EXPECT_GE(share_up_to(figure), share);
    EXPECT_LT(share_up_to(figure - 1.0), share);
  }
}

TEST(Percentiles, OfNothingCountNothingAndWhatIsNoNumberIsLeftOut) {
  EXPECT_EQ(percentiles_of({}).count, 0U);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(percentiles_of({nan, nan}).count, 0U);
  const Percentiles p = percentiles_of({nan, 3.0, nan, -2.0});
  EXPECT_EQ(p.count, 2U);
  EXPECT_EQ(p.p50, -2.0);
  EXPECT_EQ(p.max, 3.0);
  EXPECT_EQ(percentiles_of({1.0, std::numeric_limits<double>::infinity()}).max,
            std::numeric_limits<double>::infinity());
}

}  // namespace
