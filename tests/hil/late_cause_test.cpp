#include "hil/late_cause.h"

#include <atomic>
#include <ctime>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>

namespace {

using engine::Duration;
using hil::Delay;
using hil::late_cause;
using hil::LateCause;
using hil::RunTime;
using hil::RunTimeMeter;

constexpr Duration kMs{1'000'000};

TEST(LateCause, IsTheMachineWhereTheMeterWasHeldUpForMostOfTheDelay) {
  const RunTime ours{10 * kMs, 10 * kMs, 20 * kMs};
  EXPECT_EQ(late_cause({10 * kMs, true, 6 * kMs, ours}), LateCause::kMachine);
  EXPECT_EQ(late_cause({10 * kMs, false, 6 * kMs, ours}), LateCause::kMachine);
}

TEST(LateCause, IsOurOwnWorkWhereItWasNotDone) {
  EXPECT_EQ(late_cause({10 * kMs, false, 5 * kMs, {}}), LateCause::kOwnWork);
  EXPECT_EQ(late_cause({10 * kMs, false, 4 * kMs, RunTime{}}), LateCause::kOwnWork);
}

TEST(LateCause, OfALoopThatWasDoneIsTheMachineWhereItsTimerCameLate) {
  EXPECT_EQ(late_cause({10 * kMs, true, {}, RunTime{kMs, 2 * kMs, 30 * kMs}}), LateCause::kMachine);
}

TEST(LateCause, OfALoopThatWasDoneIsTheMachineWhereOtherProgramsHadItsProcessor) {
  EXPECT_EQ(late_cause({10 * kMs, true, {}, RunTime{kMs, 9 * kMs, 2 * kMs}}), LateCause::kMachine);
}

TEST(LateCause, OfALoopThatWasDoneIsOurOwnWhereOurThreadsCanHaveHadItsProcessor) {
  EXPECT_EQ(late_cause({10 * kMs, true, {}, RunTime{kMs, 9 * kMs, 9 * kMs}}), LateCause::kOwnWork);
  EXPECT_EQ(late_cause({10 * kMs, true, {}, RunTime{8 * kMs, {}, 8 * kMs}}), LateCause::kOwnWork);
}

TEST(LateCause, IsUnknownOnlyWhereTheSystemKeepsNoAccount) {
  EXPECT_EQ(late_cause({10 * kMs, true, 5 * kMs, {}}), LateCause::kUnknown);
}

Duration thread_cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return std::chrono::seconds(t.tv_sec) + Duration(t.tv_nsec);
}

bool stay_on(std::size_t core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  return sched_setaffinity(0, sizeof cores, &cores) == 0;
}

TEST(RunTimeMeter, CountsWhatTheThreadRanAndWhatItWaitedForItsProcessor) {
  // On one processor with three neighbours that never sleep, it waits three times as long as it
  // runs.
  std::atomic<int> there{0};
  std::atomic<bool> pinned{true};
  const auto core = static_cast<std::size_t>(sched_getcpu());
  std::vector<std::jthread> neighbours;
  for (int i = 0; i < 3; ++i) {
    neighbours.emplace_back([&](const std::stop_token& stop) {
      if (!stay_on(core)) pinned = false;
      ++there;
      while (!stop.stop_requested()) {
      }
    });
  }
  std::optional<RunTime> before;
  std::optional<RunTime> after;
  Duration ran{};
  std::thread measured([&] {
    if (!stay_on(core)) pinned = false;
    while (there < 3) std::this_thread::yield();
    const RunTimeMeter meter;
    before = meter.read();
    const Duration begin = thread_cpu_time();
    while (thread_cpu_time() - begin < 50 * kMs) {
    }
    ran = thread_cpu_time() - begin;
    after = meter.read();
  });
  measured.join();
  neighbours.clear();
  ASSERT_TRUE(pinned);
  if (!before || !after) GTEST_SKIP() << "the kernel keeps no account of run times";
  const RunTime used = *after - *before;
  // The account of what runs now is brought up to date at each tick of the scheduler.
  EXPECT_GT(used.ran, ran - 11 * kMs);
  EXPECT_LT(used.ran, ran + 11 * kMs);
  EXPECT_GT(used.queued, ran);
  // The neighbours ran while it was queued, and perhaps other programs too.
  EXPECT_GT(used.process_ran, used.ran + ran);
}

}  // namespace
