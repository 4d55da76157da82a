#include "hil/clock.h"

#include <gtest/gtest.h>

#include "hil/steady_clock.h"

namespace {

using engine::Duration;
using engine::sim_time;
using engine::SimTime;
using hil::ManualClock;
using hil::SteadyClock;

TEST(ManualClock, SleepsToTheNanosecondAndIsNeverLate) {
  ManualClock clock(sim_time(10.0));
  EXPECT_EQ(clock.now(), sim_time(10.0));
  const SimTime until = sim_time(12.5) + Duration(1);
  EXPECT_EQ(clock.sleep_until(until), Duration{});
  EXPECT_EQ(clock.now(), until);
}

TEST(ManualClock, SleepUntilThePastReportsHowLateItIsAndDoesNotGoBack) {
  ManualClock clock(sim_time(10.0));
  clock.pass(Duration(350'000'000));
  EXPECT_EQ(clock.sleep_until(sim_time(10.0)), Duration(350'000'000));
  EXPECT_EQ(clock.now(), sim_time(10.35));
  EXPECT_EQ(clock.sleep_until(clock.now()), Duration{});
}

TEST(SteadyClock, StartsNoEarlierThanItWasTold) {
  const SteadyClock clock(sim_time(1000.0));
  EXPECT_GE(clock.now(), sim_time(1000.0));
}

TEST(SteadyClock, NeverGoesBack) {
  const SteadyClock clock(sim_time(0.0));
  SimTime last = clock.now();
  Duration last_stopwatch = SteadyClock::stopwatch();
  for (int i = 0; i < 100'000; ++i) {
    const SimTime now = clock.now();
    ASSERT_GE(now, last);
    last = now;
    const Duration stopwatch = SteadyClock::stopwatch();
    ASSERT_GE(stopwatch, last_stopwatch);
    last_stopwatch = stopwatch;
  }
}

TEST(SteadyClock, SleepUntilThePastReturnsWithAtLeastThatLateness) {
  // An hour: were it slept, the test's own time limit would end it.
  SteadyClock clock(sim_time(7200.0));
  EXPECT_GE(clock.sleep_until(sim_time(3600.0)), Duration(std::chrono::hours(1)));
  // Before the machine was switched on: the absolute deadline is negative.
  EXPECT_GE(clock.sleep_until(sim_time(-1e8)), engine::from_seconds(1e8 + 7200.0));
}

TEST(SteadyClock, WakesNoEarlierThanAskedAndIsNeverEarly) {
  SteadyClock clock(sim_time(5.0));
  for (int i = 0; i < 20; ++i) {
    const SimTime until = clock.now() + Duration(200'000);
    const Duration late = clock.sleep_until(until);
    EXPECT_GE(late, Duration{});
    EXPECT_GE(clock.now(), until + late);
  }
}

// A set-up that took long must not eat the first frames.
TEST(SteadyClock, ARestartedClockStandsWhereItIsTold) {
  hil::SteadyClock clock(engine::sim_time(100.0));
  static_cast<void>(clock.sleep_until(engine::sim_time(100.0) + engine::Duration(5'000'000)));
  clock.restart(engine::sim_time(50.0));
  EXPECT_GE(clock.now(), engine::sim_time(50.0));
  EXPECT_LT(clock.now(), engine::sim_time(100.0));
}

}  // namespace
