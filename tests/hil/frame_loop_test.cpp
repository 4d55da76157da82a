#include "hil/frame_loop.h"

#include <algorithm>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hil/frame_loop.h"
#include "hil/no_commands.h"
#include "tests/support/fakes.h"
#include "tests/support/small_loops.h"

namespace {

using namespace small_loops;
using engine::Error;
using engine::Fault;
using engine::sim_time;
using engine::SimTime;
using engine::Status;
using fakes::IdealPointing;
using hil::WhenBusy;

// ---- the grid -------------------------------------------------------------------------------

TEST(FrameLoop, OpensEveryShutterOnTheGridAndSendsEveryFrameInOrder) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  std::vector<SimTime> opened_at;
  fakes::PixelGenerator generator([&](const engine::Shot&) { opened_at.push_back(clock.now()); });
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(40), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.due, 40U);
  EXPECT_EQ(report.sent, 40U);
  EXPECT_EQ(report.late, 0U);
  EXPECT_EQ(report.records_lost, 0U);
  expect_adds_up(report);
  const auto records = drain(loop.frames());
  ASSERT_EQ(records.size(), 40U);
  ASSERT_EQ(sink.sequences().size(), 40U);
  for (std::uint64_t k = 0; k < 40; ++k) {
    EXPECT_EQ(records[k].sequence, k);
    EXPECT_EQ(records[k].shutter_open, opening(k));
    EXPECT_EQ(records[k].late, Duration{});
    EXPECT_EQ(records[k].skipped_before, 0U);
    EXPECT_TRUE(records[k].handed_over);
    EXPECT_EQ(generator.shots()[k].shutter_open, opening(k));
    EXPECT_EQ(generator.shots()[k].exposure, kMillisecond);
    EXPECT_EQ(opened_at[k], opening(k));
    EXPECT_EQ(sink.sequences()[k], k);
  }
}

TEST(FrameLoop, FrameCarriesWhatTheCameraKnowsOfItself) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing(3e-4);
  fakes::PixelGenerator generator;
  fakes::Device device([](const Frame& frame) {
    EXPECT_EQ(frame.shutter_open, opening(frame.sequence));
    EXPECT_EQ(frame.exposure, kMillisecond);
    EXPECT_EQ(frame.bits, 11);
    EXPECT_EQ(frame.pixels->width(), 8);
    EXPECT_EQ(frame.pixels->height(), 2);
    // What the frame shows and the trim read back belong to the same instant.
    EXPECT_EQ(fakes::seen_in(frame), 3e-4 + frame.trim_rad[0]);
    return trim_answer(frame, -1e-5 * static_cast<double>(frame.sequence + 1));
  });
  FrameLoop loop(lockstep_loop(20), clock, pointing, generator, device, device);
  EXPECT_EQ(loop.run({}).sent, 20U);
  for (const FrameRecord& r : drain(loop.frames()))
    EXPECT_EQ(r.trim_rad[0], -1e-5 * static_cast<double>(r.sequence)) << r.sequence;
}

/// A loop whose generator takes `stall` for frame `at`, once.
struct Stalled {
  LoopReport report;
  std::vector<FrameRecord> records;
  std::vector<SimTime> opened_at;
  int pointing_steps_back = 0;
};
Stalled run_stalled(std::uint64_t frames, std::uint64_t at, Duration stall) {
  Stalled out;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator([&](const engine::Shot& shot) {
    out.opened_at.push_back(clock.now());
    if (shot.sequence == at) clock.pass(stall);
  });
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(frames), clock, pointing, generator, sink, source);
  out.report = loop.run({});
  out.records = drain(loop.frames());
  out.pointing_steps_back = pointing.steps_back();
  return out;
}

// A stall of 3.5 periods during frame k is over at k + 3.5: k + 1, k + 2 and k + 3 have gone by.
TEST(FrameLoop, AStallOfThreeAndAHalfPeriodsLosesThreeFramesAndNothingIsCaughtUp) {
  const Stalled run = run_stalled(20, 5, kPeriod * 7 / 2);
  EXPECT_EQ(run.report.due, 20U);
  EXPECT_EQ(run.report.skipped, 3U);
  EXPECT_EQ(run.report.sent, 17U);
  EXPECT_EQ(run.report.late, 0U);
  expect_adds_up(run.report);
  EXPECT_EQ(run.pointing_steps_back, 0);
  std::vector<std::uint64_t> sequences;
  for (std::size_t i = 0; i < run.records.size(); ++i) {
    const FrameRecord& r = run.records[i];
    sequences.push_back(r.sequence);
    // No phase error and no burst: later frames stand on the grid of before.
    EXPECT_EQ(r.shutter_open, opening(r.sequence));
    EXPECT_EQ(run.opened_at[i], opening(r.sequence));
    EXPECT_EQ(r.late, Duration{});
    EXPECT_EQ(r.skipped_before, r.sequence == 9 ? 3U : 0U);
  }
  EXPECT_EQ(sequences, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 9, 10, 11, 12, 13, 14, 15, 16,
                                                   17, 18, 19}));
  EXPECT_EQ(run.records[5].busy, kPeriod * 7 / 2);
}

TEST(FrameLoop, AStallLosesExactlyThePeriodsThatWentBy) {
  struct Case {
    Duration stall;
    std::uint64_t skipped;
    Duration late;  ///< of the next frame
  };
  // A shutter that can still open within a millisecond of its time opens.
  const std::vector<Case> cases = {
      {Duration{}, 0, {}},
      {kPeriod / 2, 0, {}},
      {kPeriod - Duration(1), 0, {}},
      {kPeriod, 0, {}},
      {kPeriod + kMillisecond / 2, 0, kMillisecond / 2},
      {kPeriod + kMillisecond, 0, kMillisecond},
      {kPeriod + kMillisecond + Duration(1), 1, {}},
      {kPeriod * 2 - Duration(1), 1, {}},
      {kPeriod * 2, 1, {}},
      {kPeriod * 2 + Duration(1), 2, {}},
      {kPeriod * 7 / 2, 3, {}},
      {kPeriod * 9, 8, {}},
      {kPeriod * 10, 9, {}},
      {kPeriod * 14 + Duration(1), 14, {}},  // the rest of the run
      {kPeriod * 1000, 14, {}},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.stall.count());
    const Stalled run = run_stalled(20, 5, c.stall);
    EXPECT_EQ(run.report.due, 20U);
    EXPECT_EQ(run.report.skipped, c.skipped);
    EXPECT_EQ(run.report.sent, 20U - c.skipped);
    expect_adds_up(run.report);
    EXPECT_EQ(run.pointing_steps_back, 0);
    if (c.skipped == 14) continue;
    ASSERT_GT(run.records.size(), 6U);
    EXPECT_EQ(run.records[6].sequence, 6U + c.skipped);
    EXPECT_EQ(run.records[6].late, c.late);
  }
}

TEST(FrameLoop, ALoopThatStartsLateSkipsWhatIsOverAndCountsIt) {
  hil::ManualClock clock(kStart + kPeriod * 5 / 2);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(10), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.skipped, 3U);
  EXPECT_EQ(report.due, 10U);
  expect_adds_up(report);
  ASSERT_EQ(sink.sequences().size(), 7U);
  EXPECT_EQ(sink.sequences().front(), 3U);
}

TEST(FrameLoop, CountsFramesThatWereWokenOverAMillisecondLate) {
  for (const Duration oversleep : {kMillisecond, kMillisecond + Duration(1)}) {
    fakes::HookedClock clock(kStart - kPeriod, {}, oversleep);
    IdealPointing pointing;
    fakes::PixelGenerator generator;
    fakes::Sink sink;
    hil::NoCommands source;
    FrameLoop loop(patient_loop(10), clock, pointing, generator, sink, source);
    const LoopReport report = loop.run({});
    EXPECT_EQ(report.sent, 10U);
    EXPECT_EQ(report.late, oversleep > kMillisecond ? 10U : 0U);
    expect_adds_up(report);
    for (const FrameRecord& r : drain(loop.frames())) EXPECT_EQ(r.late, oversleep);
  }
}

TEST(FrameLoop, ASecondOfStallsAtRandomStillAddsUp) {
  std::uint64_t state = 1;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator([&](const engine::Shot&) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    clock.pass(Duration(static_cast<std::int64_t>((state >> 33) % 250'000'000)));
  });
  fakes::Sink sink([](const Frame& frame, Duration) -> Status {
    if (frame.sequence % 3 == 0) return Error{Fault::kDisconnected, 0, "test"};
    return engine::Done{};
  });
  hil::NoCommands source;
  FrameLoop loop(patient_loop(200), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.due, 200U);
  EXPECT_GT(report.skipped, 0U);
  EXPECT_GT(report.faults, 0U);
  expect_adds_up(report);
  EXPECT_EQ(pointing.steps_back(), 0);
  std::uint64_t next = 0;
  for (const FrameRecord& r : drain(loop.frames())) {
    EXPECT_EQ(r.sequence, next + r.skipped_before);
    next = r.sequence + 1;
  }
}

// ---- the link -------------------------------------------------------------------------------

TEST(FrameLoop, ASinkThatRefusesCountsFaultsAndRemembersTheLast) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink([](const Frame& frame, Duration) -> Status {
    if (frame.sequence % 4 == 1)
      return Error{Fault::kRejected, static_cast<int>(frame.sequence), "test"};
    return engine::Done{};
  });
  hil::NoCommands source;
  FrameLoop loop(patient_loop(20), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.faults, 5U);
  EXPECT_EQ(report.sent, 15U);
  EXPECT_EQ(report.last_fault.fault, Fault::kRejected);
  EXPECT_EQ(report.last_fault.code, 17);
  EXPECT_STREQ(report.last_fault.step, "test");
  expect_adds_up(report);
}

TEST(FrameLoop, ASinkThatHoldsEverySlotCostsFramesButNeverDelaysTheLoop) {
  constexpr std::uint64_t kFrames = 50;
  constexpr std::uint64_t kSlots = 4;
  std::counting_semaphore<> gate{0};
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink([&gate](const Frame&, Duration) -> Status {
    gate.acquire();
    return engine::Done{};
  });
  hil::NoCommands source;
  FrameLoop loop(small_loop(kFrames), clock, pointing, generator, sink, source);
  LoopReport report;
  std::jthread runner([&] { report = loop.run({}); });
  // The gate opens only when the loop is through: were it held up by the sink, nobody would.
  std::vector<FrameRecord> records;
  while (records.size() < kFrames) {
    if (FrameRecord r; loop.frames().pop(r)) {
      records.push_back(r);
    } else {
      std::this_thread::yield();
    }
  }
  gate.release(kFrames);
  runner.join();
  EXPECT_EQ(report.due, kFrames);
  EXPECT_EQ(report.sent, kSlots);
  EXPECT_EQ(report.dropped, kFrames - kSlots);
  EXPECT_EQ(report.skipped, 0U);
  EXPECT_EQ(report.late, 0U);
  expect_adds_up(report);
  for (const FrameRecord& r : records) {
    EXPECT_EQ(r.handed_over, r.sequence < kSlots);
    EXPECT_EQ(r.late, Duration{});
    EXPECT_EQ(r.shutter_open, opening(r.sequence));
  }
  EXPECT_EQ(sink.sequences(), (std::vector<std::uint64_t>{0, 1, 2, 3}));
}

TEST(FrameLoop, ARehearsalWaitsForItsSinkAndKeepsEveryFrame) {
  constexpr std::uint64_t kFrames = 50;
  std::counting_semaphore<> gate{0};
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink([&gate](const Frame& frame, Duration) -> Status {
    gate.acquire();
    // The slot is still the sender's: nobody has written into it meanwhile.
    EXPECT_EQ(frame.shutter_open, opening(frame.sequence));
    return engine::Done{};
  });
  hil::NoCommands source;
  FrameLoop loop(patient_loop(kFrames), clock, pointing, generator, sink, source);
  LoopReport report;
  std::jthread runner([&] { report = loop.run({}); });
  // The first four fill the slots. A loop that did not wait would run on while we look for a fifth.
  std::vector<FrameRecord> records;
  for (int looks_for_a_fifth = 0; records.size() <= 4 && looks_for_a_fifth < 20'000;) {
    if (FrameRecord r; loop.frames().pop(r)) {
      records.push_back(r);
    } else {
      std::this_thread::yield();
      if (records.size() == 4) ++looks_for_a_fifth;
    }
  }
  EXPECT_EQ(records.size(), 4U);
  gate.release(kFrames);
  runner.join();
  EXPECT_EQ(report.sent, kFrames);
  EXPECT_EQ(report.dropped, 0U);
  expect_adds_up(report);
  for (std::uint64_t k = 0; k < kFrames; ++k) EXPECT_EQ(sink.sequences()[k], k);
}

TEST(FrameLoop, NobodyWritesIntoAFrameWhileTheSinkHasIt) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  int wrong = 0;
  fakes::Sink sink([&](const Frame& frame, Duration) -> Status {
    // The loop runs ahead as far as it can meanwhile.
    for (int i = 0; i < 100; ++i) {
      if (frame.pixels->pixels().back() != frame.sequence) ++wrong;
      std::this_thread::yield();
    }
    return engine::Done{};
  });
  hil::NoCommands source;
  FrameLoop loop(patient_loop(200), clock, pointing, generator, sink, source);
  EXPECT_EQ(loop.run({}).sent, 200U);
  EXPECT_EQ(wrong, 0);
}

TEST(FrameLoop, AnObserverThatNeverLooksCostsRecordsAndNoFrames) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(300), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, 300U);
  EXPECT_EQ(report.records_lost, 300U - 256U);
  const auto records = drain(loop.frames());
  ASSERT_EQ(records.size(), 256U);
  EXPECT_EQ(records.back().sequence, 255U);
}

TEST(FrameLoopDeathTest, RefusesAnExposureThatDoesNotFitIntoAPeriod) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  LoopSpec spec = small_loop(1);
  spec.exposure = spec.period - spec.command_lead + Duration(1);
  hil::ManualClock clock(kStart);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  hil::NoCommands source;
  EXPECT_DEATH(FrameLoop(spec, clock, pointing, generator, sink, source), "our own mistake");
}

}  // namespace
