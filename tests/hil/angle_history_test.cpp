#include "hil/angle_history.h"

#include <gtest/gtest.h>

namespace {

using engine::sim_time;
using hil::AngleHistory;
using hil::TrimAngles;

TEST(AngleHistory, IsLinearBetweenInstantsAndEndsWithThem) {
  AngleHistory history;
  history.add(sim_time(1.0), {0.0, 8.0});
  history.add(sim_time(2.0), {1.0, 4.0});
  history.add(sim_time(4.0), {5.0, 0.0});
  EXPECT_EQ(history.at(sim_time(0.0)), (TrimAngles{0.0, 8.0}));
  EXPECT_EQ(history.at(sim_time(1.0)), (TrimAngles{0.0, 8.0}));
  EXPECT_EQ(history.at(sim_time(1.5)), (TrimAngles{0.5, 6.0}));
  EXPECT_EQ(history.at(sim_time(3.5)), (TrimAngles{4.0, 1.0}));
  EXPECT_EQ(history.at(sim_time(9.0)), (TrimAngles{5.0, 0.0}));
}

TEST(AngleHistory, TheSameInstantAgainReplacesIt) {
  AngleHistory history;
  history.add(sim_time(1.0), {1.0, 1.0});
  history.add(sim_time(2.0), {2.0, 2.0});
  history.add(sim_time(2.0), {7.0, 7.0});
  EXPECT_EQ(history.at(sim_time(2.0)), (TrimAngles{7.0, 7.0}));
  EXPECT_EQ(history.at(sim_time(1.0)), (TrimAngles{1.0, 1.0}));
}

TEST(AngleHistory, RemembersSixtyFourInstants) {
  AngleHistory history;
  for (int i = 0; i < 1000; ++i) history.add(sim_time(i), {1.0 * i, 0.0});
  EXPECT_EQ(history.at(sim_time(936.5))[0], 936.5);
  EXPECT_EQ(history.at(sim_time(900.0))[0], 936.0);
}

TEST(AngleHistory, StartsAnewWhenCleared) {
  AngleHistory history;
  history.add(sim_time(1.0), {1.0, 1.0});
  history.clear();
  history.add(sim_time(3.0), {3.0, 3.0});
  EXPECT_EQ(history.at(sim_time(1.0)), (TrimAngles{3.0, 3.0}));
}

}  // namespace
