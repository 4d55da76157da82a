#include "hil/hiccup_meter.h"

#include <algorithm>
#include <csignal>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hil/frame_loop.h"
#include "hil/no_commands.h"
#include "tests/support/fakes.h"

namespace {

using engine::Duration;
using hil::Hiccup;
using hil::HiccupHistory;
using hil::LateCause;
using hil::WakeHistogram;

constexpr Duration kMillisecond{1'000'000};

TEST(WakeHistogram, QuantilesAreThoseOfTheSortedWakesToABin) {
  std::mt19937 random(3);
  std::lognormal_distribution<double> late_s(std::log(50e-6), 1.0);
  WakeHistogram histogram;
  std::vector<Duration> wakes;
  for (int i = 0; i < 20'000; ++i) {
    wakes.push_back(engine::from_seconds(late_s(random)));
    histogram.add(wakes.back());
  }
  std::sort(wakes.begin(), wakes.end());
  EXPECT_EQ(histogram.count(), 20'000U);
  EXPECT_EQ(histogram.worst(), wakes.back());
  for (const double share : {0.1, 0.5, 0.99, 0.999}) {
    const double exact = engine::seconds(wakes[static_cast<std::size_t>(share * 20'000.0) - 1]);
    const double got = engine::seconds(histogram.quantile(share));
    // A bin is an eighth of an octave wide, 9.05 %, and its upper edge is told.
    EXPECT_GE(got, exact) << share;
    EXPECT_LE(got, exact * std::exp2(0.125) * 1.000001) << share;
  }
  EXPECT_EQ(histogram.quantile(1.0), wakes.back());
}

TEST(WakeHistogram, TakesNothingAndEverything) {
  WakeHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), Duration{});
  for (const Duration d : {Duration(-5), Duration{}, Duration(1), Duration::max()})
    histogram.add(d);
  EXPECT_EQ(histogram.count(), 4U);
  EXPECT_EQ(histogram.quantile(1.0), Duration::max());
}

TEST(HiccupHistory, SaysHowMuchOfAStretchWasHeldUp) {
  HiccupHistory history;
  EXPECT_EQ(history.within(Duration{}, Duration(1'000)), Duration{});
  history.add({Duration(100), Duration(200)});
  history.add({Duration(300), Duration(310)});
  EXPECT_EQ(history.within(Duration{}, Duration(1'000)), Duration(110));
  EXPECT_EQ(history.within(Duration(150), Duration(305)), Duration(55));
  EXPECT_EQ(history.within(Duration(200), Duration(300)), Duration{});
  EXPECT_EQ(history.within(Duration(120), Duration(130)), Duration(10));
}

TEST(HiccupHistory, ForgetsTheOldestFirst) {
  HiccupHistory history;
  for (int i = 0; i < 300; ++i) history.add({Duration(10 * i), Duration(10 * i + 1)});
  EXPECT_EQ(history.within(Duration{}, Duration(10'000)), Duration(256));
  EXPECT_EQ(history.within(Duration(2'990), Duration(3'000)), Duration(1));
  EXPECT_EQ(history.within(Duration{}, Duration(430)), Duration{});
}

/// Runs a loop in real time that says when its tenth frame has opened; 0: a stall of the whole
/// process was laid at the machine's door, and nothing else was.
int run_loop_that_is_stopped(int tell) {
  constexpr Duration kPeriod = 10 * kMillisecond;
  hil::HiccupMeter meter(0);
  hil::SteadyClock clock(engine::sim_time(1.0) - kPeriod);
  fakes::IdealPointing pointing;
  fakes::PixelGenerator generator([tell](const engine::Shot& shot) {
    const char byte = 0;
    if (shot.sequence == 10 && write(tell, &byte, 1) != 1) std::_Exit(10);
  });
  fakes::Sink sink;
  hil::NoCommands source;
  hil::LoopSpec spec;
  spec.start = engine::sim_time(1.0);
  spec.period = kPeriod;
  spec.frames = 120;
  spec.command_lead = kMillisecond;
  spec.width_px = 8;
  spec.height_px = 2;
  spec.hiccups = &meter;
  hil::FrameLoop loop(spec, clock, pointing, generator, sink, source);
  static_cast<void>(loop.run({}));
  if (meter.finish().worst() < 100 * kMillisecond) return 11;
  for (hil::FrameRecord r; loop.frames().pop(r);) {
    const Duration delay = r.late + kPeriod * static_cast<std::int64_t>(r.skipped_before);
    if (delay > 100 * kMillisecond) return r.late_cause == LateCause::kMachine ? 0 : 12;
  }
  return 13;  // the stall was not seen
}

// Stopped and continued from outside, as a suspended virtual machine is.
TEST(HiccupMeter, AStallOfTheWholeProcessIsTheMachinesDoing) {
  std::array<int, 2> tell{};
  ASSERT_EQ(pipe(tell.data()), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) std::_Exit(run_loop_that_is_stopped(tell[1]));
  close(tell[1]);
  char byte = 0;
  ASSERT_EQ(read(tell[0], &byte, 1), 1) << "the loop ended before its tenth frame";
  close(tell[0]);
  kill(child, SIGSTOP);
  usleep(300'000);
  kill(child, SIGCONT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(HiccupMeter, EndsWhenItIsTold) {
  hil::HiccupMeter meter(0);
  const std::uint64_t wakes = meter.finish().count();
  EXPECT_EQ(meter.finish().count(), wakes);
}

}  // namespace
