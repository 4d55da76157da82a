// When a command is obeyed, and when a loop that waits for one ends.

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

// The documented latency: a command that answers frame k shows in frame k + 1.
TEST(FrameLoop, InLockstepTheAnswerToAFrameShowsInTheNext) {
  constexpr std::uint64_t kFrames = 30;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Device device([](const Frame& frame) {
    return trim_answer(frame, 1.0 + static_cast<double>(frame.sequence));
  });
  const LoopSpec spec = lockstep_loop(kFrames);
  FrameLoop loop(spec, clock, pointing, generator, device, device);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, kFrames);
  EXPECT_EQ(report.commands, kFrames);
  EXPECT_FALSE(report.answer_missing);
  expect_adds_up(report);

  // Frame k shows the trim that answered frame k - 1, during its whole exposure.
  for (const engine::Shot& shot : generator.shots()) {
    ASSERT_TRUE(shot.attitude.known_between);
    for (int step = 0; step <= engine::AttitudeTrack::kSteps; ++step)
      EXPECT_EQ(shot.attitude.after(step).axes.matrix(0, 0), static_cast<double>(shot.sequence))
          << shot.sequence;
  }
  // Up to the slot the old trim holds; then the new one; then the exposure.
  std::vector<IdealPointing::Event> expected;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    using What = IdealPointing::What;
    expected.push_back({What::kAttitude, opening(k) - spec.command_lead, 0});
    if (k > 0) expected.push_back({What::kApply, {}, k - 1});
    expected.push_back({What::kAttitude, opening(k), 0});
    expected.push_back({What::kAttitude, opening(k) + spec.exposure / 2, 0});
    expected.push_back({What::kAttitude, opening(k) + spec.exposure, 0});
  }
  expected.push_back({IdealPointing::What::kApply, {}, kFrames - 1});
  EXPECT_EQ(pointing.events(), expected);
  EXPECT_EQ(pointing.steps_back(), 0);

  // The record says the same, the last answer included.
  const auto records = drain(loop.commands());
  ASSERT_EQ(records.size(), kFrames);
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    EXPECT_EQ(records[k].command.answers_frame, k);
    EXPECT_EQ(records[k].frame, k + 1);
  }
}

/// A loop on the rig's terms whose only command comes in just before the sleep that ends at `at`.
struct Timed {
  LoopReport report;
  std::vector<CommandRecord> commands;
  std::vector<engine::Shot> shots;
};
Timed run_with_command_before(SimTime at) {
  fakes::QueueSource source;
  fakes::HookedClock clock(kStart - kPeriod, [&](SimTime until) {
    if (until != at) return;
    Command command;
    command.kind = CommandKind::kTrim;
    command.trim_offset_rad = {1.0, 0.0};
    source.give(command);
    source.wait_until_taken();
  });
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  FrameLoop loop(patient_loop(10), clock, pointing, generator, sink, source);
  Timed out;
  out.report = loop.run({});
  out.commands = drain(loop.commands());
  out.shots = generator.shots();
  EXPECT_EQ(pointing.steps_back(), 0);
  return out;
}

TEST(FrameLoop, ACommandThatIsInBeforeTheSlotShowsInThatFrame) {
  const Timed run = run_with_command_before(opening(4) - LoopSpec{}.command_lead);
  ASSERT_EQ(run.commands.size(), 1U);
  EXPECT_EQ(run.commands[0].frame, 4U);
  for (const engine::Shot& shot : run.shots)
    EXPECT_EQ(shot.attitude.open.axes.matrix(0, 0), shot.sequence >= 4 ? 1.0 : 0.0);
}

TEST(FrameLoop, ACommandAfterTheSlotWaitsForTheNext) {
  const Timed run = run_with_command_before(opening(4));
  ASSERT_EQ(run.commands.size(), 1U);
  EXPECT_EQ(run.commands[0].frame, 5U);
  for (const engine::Shot& shot : run.shots)
    EXPECT_EQ(shot.attitude.open.axes.matrix(0, 0), shot.sequence >= 5 ? 1.0 : 0.0);
}

TEST(FrameLoop, CommandsOfOneSlotAreObeyedInTheOrderTheyCame) {
  fakes::QueueSource source;
  fakes::HookedClock clock(kStart - kPeriod, [&](SimTime until) {
    if (until != opening(3)) return;
    for (std::uint64_t i = 0; i < 20; ++i) {
      Command command;
      command.answers_frame = i;
      source.give(command);
    }
    source.wait_until_taken();
  });
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  FrameLoop loop(patient_loop(6), clock, pointing, generator, sink, source);
  EXPECT_EQ(loop.run({}).commands, 20U);
  const auto records = drain(loop.commands());
  ASSERT_EQ(records.size(), 20U);
  for (std::uint64_t i = 0; i < 20; ++i) {
    EXPECT_EQ(records[i].command.answers_frame, i);
    EXPECT_EQ(records[i].frame, 4U);
  }
}

TEST(FrameLoop, AFloodOfCommandsIsObeyedOrCountedAsLost) {
  constexpr std::uint64_t kFlood = 1000;
  fakes::QueueSource source;
  fakes::HookedClock clock(kStart - kPeriod, [&](SimTime until) {
    if (until != opening(3)) return;
    for (std::uint64_t i = 0; i < kFlood; ++i) source.give(Command{});
    source.wait_until_taken();
  });
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  FrameLoop loop(patient_loop(6), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, 6U);
  EXPECT_EQ(report.commands, 256U);  // the ring between receiver and loop
  EXPECT_EQ(report.commands + report.commands_lost, kFlood);
  expect_adds_up(report);
}

TEST(FrameLoop, PacketsThatAreNoCommandsAreCountedAndTheNextIsObeyed) {
  fakes::QueueSource source;
  fakes::HookedClock clock(kStart - kPeriod, [&](SimTime until) {
    if (until != opening(2)) return;
    for (int i = 0; i < 7; ++i) source.give(Error{Fault::kRejected, 0, "test"});
    source.give(Error{Fault::kTimeout, 0, "test"});       // nothing came: no fault
    source.give(Error{Fault::kDisconnected, 0, "test"});  // nobody there: no packet
    source.give(Command{});
    source.wait_until_taken();
  });
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  FrameLoop loop(patient_loop(5), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.command_faults, 7U);
  EXPECT_EQ(report.commands, 1U);
}

TEST(FrameLoop, InLockstepOtherCommandsDoNotCountAsTheAnswerAndNoneIsLost) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::QueueSource answers;
  fakes::Sink sink([&answers](const Frame& frame, Duration) -> Status {
    Command stale = trim_answer(frame, -7.0);
    stale.answers_frame = frame.sequence - 1;  // of the frame before; of none at first
    stale.kind = CommandKind::kReport;
    answers.give(stale);
    answers.give(trim_answer(frame, static_cast<double>(frame.sequence) + 1.0));
    return engine::Done{};
  });
  FrameLoop loop(lockstep_loop(20), clock, pointing, generator, sink, answers);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, 20U);
  EXPECT_EQ(report.commands, 40U);
  EXPECT_FALSE(report.answer_missing);
  for (const engine::Shot& shot : generator.shots())
    EXPECT_EQ(shot.attitude.open.axes.matrix(0, 0), static_cast<double>(shot.sequence));
}

// ---- ends -----------------------------------------------------------------------------------

TEST(FrameLoop, LockstepEndsWhenAnAnswerDoesNotCome) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Device device([](const Frame& frame) -> std::optional<Command> {
    if (frame.sequence == 3) return std::nullopt;
    return trim_answer(frame);
  });
  LoopSpec spec = lockstep_loop(100);
  // Long enough for a busy machine to pass the first three answers on.
  spec.answer_timeout = std::chrono::milliseconds(300);
  FrameLoop loop(spec, clock, pointing, generator, device, device);
  const LoopReport report = loop.run({});
  EXPECT_TRUE(report.answer_missing);
  EXPECT_EQ(report.due, 4U);
  EXPECT_EQ(report.sent, 4U);
  EXPECT_EQ(report.commands, 3U);
  expect_adds_up(report);
  EXPECT_EQ(drain(loop.frames()).size(), 4U);
}

TEST(FrameLoop, LockstepEndsWhenTheLinkIsGone) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink([](const Frame&, Duration) -> Status {
    return Error{Fault::kDisconnected, 19, "gone"};
  });
  hil::NoCommands source;
  LoopSpec spec = lockstep_loop(100);
  spec.answer_timeout = kMillisecond;
  FrameLoop loop(spec, clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_TRUE(report.answer_missing);
  EXPECT_EQ(report.faults, 1U);
  expect_adds_up(report);
}

TEST(FrameLoop, LockstepAnswersThatNeverFitDoNotKeepItWaitingForEver) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  hil::NoCommands nobody;
  // A device that talks all the time, but of another frame: one command after the other, as fast
  // as the loop takes them, and each sooner than the timeout.
  class Chatter final : public hil::CommandSource {
   public:
    engine::Expected<Command> receive(Duration timeout) noexcept override {
      static_cast<void>(pause_.try_acquire_for(std::min(timeout, kMillisecond)));
      Command command;
      command.answers_frame = 999;
      // Enough for ten timeouts; then it gives up, so that this test ends either way.
      if (++said_ > 1000) return Error{Fault::kTimeout, 0, "chatter"};
      return command;
    }
    [[nodiscard]] int said() const noexcept { return said_; }

   private:
    std::counting_semaphore<> pause_{0};
    int said_ = 0;
  } chatter;
  fakes::Sink sink;
  LoopSpec spec = lockstep_loop(3);
  spec.answer_timeout = kMillisecond * 100;
  FrameLoop loop(spec, clock, pointing, generator, sink, chatter);
  const LoopReport report = loop.run({});
  EXPECT_TRUE(report.answer_missing);
  EXPECT_LT(chatter.said(), 1000) << "the wait began anew with every command";
  expect_adds_up(report);
}

TEST(FrameLoop, AStopEndsItAfterTheFrameInHand) {
  std::stop_source stop;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator([&stop](const engine::Shot& shot) {
    if (shot.sequence == 5) stop.request_stop();
  });
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(1'000'000), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run(stop.get_token());
  EXPECT_EQ(report.due, 6U);
  EXPECT_EQ(report.sent, 6U);
  expect_adds_up(report);
}

TEST(FrameLoop, AStopBeforeTheFirstFrameSendsNone) {
  std::stop_source stop;
  stop.request_stop();
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Sink sink;
  hil::NoCommands source;
  FrameLoop loop(patient_loop(10), clock, pointing, generator, sink, source);
  const LoopReport report = loop.run(stop.get_token());
  EXPECT_EQ(report.due, 0U);
  EXPECT_TRUE(sink.sequences().empty());
}

TEST(FrameLoop, AStopReachesALoopThatWaitsForASlot) {
  std::stop_source stop;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  // Holds every frame until the stop, and then as long as it was allowed to: not at all.
  fakes::Sink sink([&stop](const Frame& frame, Duration) -> Status {
    if (frame.sequence == 0) {
      while (!stop.stop_requested()) std::this_thread::yield();
    }
    return Error{Fault::kBusy, 0, "held"};
  });
  hil::NoCommands source;
  FrameLoop loop(patient_loop(1'000'000), clock, pointing, generator, sink, source);
  LoopReport report;
  std::jthread runner([&] { report = loop.run(stop.get_token()); });
  std::uint64_t seen = 0;
  while (seen < 4) {
    if (FrameRecord r; loop.frames().pop(r)) {
      ++seen;
    } else {
      std::this_thread::yield();
    }
  }
  stop.request_stop();
  runner.join();
  EXPECT_GE(report.due, 4U);
  EXPECT_LE(report.due, 6U);
  expect_adds_up(report);
}

TEST(FrameLoop, AStopReachesALoopThatWaitsForAnAnswer) {
  std::stop_source stop;
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Device device([&stop](const Frame& frame) -> std::optional<Command> {
    if (frame.sequence < 3) return trim_answer(frame);
    stop.request_stop();
    return std::nullopt;
  });
  LoopSpec spec = lockstep_loop(100);
  spec.answer_timeout = std::chrono::seconds(3);
  FrameLoop loop(spec, clock, pointing, generator, device, device);
  const LoopReport report = loop.run(stop.get_token());
  EXPECT_EQ(report.due, 4U);
  EXPECT_FALSE(report.answer_missing) << "it waited out the whole timeout, deaf to the stop";
  expect_adds_up(report);
}

TEST(FrameLoop, TheLastFramesAnswerIsInTheRecord) {
  hil::ManualClock clock(kStart - kPeriod);
  IdealPointing pointing;
  fakes::PixelGenerator generator;
  fakes::Device device([](const Frame& frame) { return trim_answer(frame); });
  FrameLoop loop(lockstep_loop(1), clock, pointing, generator, device, device);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.commands, 1U);
  const auto records = drain(loop.commands());
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records[0].command.answers_frame, 0U);
  EXPECT_EQ(records[0].frame, 1U);
}

}  // namespace
