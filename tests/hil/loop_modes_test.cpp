// Who says when a shutter opens, and whose fault it is when it opens late.

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
using hil::LateCause;

TEST(TriggeredLoop, MakesOneFrameForEachPullAndEndsWhenNobodyPullsAnyMore) {
  Rig rig;
  fakes::PixelGenerator generator;
  hil::Trigger trigger;
  LoopSpec spec = patient_loop(100);
  spec.trigger = &trigger;
  spec.trigger_timeout = kMillisecond;
  for (int i = 0; i < 7; ++i) trigger.pull();
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, rig.sink, rig.silent);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.due, 7U);
  EXPECT_EQ(report.sent, 7U);
  EXPECT_TRUE(report.trigger_missing);
  // Simulated time goes on by a period a frame, however long the pulls lie apart.
  EXPECT_EQ(generator.shots().back().shutter_open, kStart + 6 * kPeriod);
}

TEST(TriggeredLoop, OpensNoShutterBeforeThePull) {
  Rig rig;
  hil::Trigger trigger;
  std::atomic<int> pulled{0};
  bool too_early = false;
  std::uint64_t seen = 0;
  fakes::PixelGenerator generator([&](const engine::Shot& shot) {
    too_early = too_early || pulled.load() <= static_cast<int>(shot.sequence);
    ++seen;
  });
  LoopSpec spec = patient_loop(20);
  spec.trigger = &trigger;
  spec.trigger_timeout = std::chrono::seconds(20);
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, rig.sink, rig.silent);
  std::jthread puller([&] {
    for (int i = 0; i < 20; ++i) {
      std::this_thread::yield();
      ++pulled;
      trigger.pull();
    }
  });
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, 20U);
  EXPECT_FALSE(report.trigger_missing);
  EXPECT_FALSE(too_early);
}

TEST(TriggeredLoop, APacketPullsTheTriggerAndIsNothingToObey) {
  Rig rig;
  fakes::PixelGenerator generator;
  hil::Trigger trigger;
  // Each frame asks for the next.
  fakes::Device device([](const Frame& frame) -> std::optional<Command> {
    if (frame.sequence == 9) return std::nullopt;
    Command command;
    command.sequence = frame.sequence + 1;
    command.kind = CommandKind::kTrigger;
    return command;
  });
  trigger.pull();
  LoopSpec spec = patient_loop(10);
  spec.trigger = &trigger;
  spec.trigger_timeout = std::chrono::seconds(20);
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, device, device);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, 10U);
  EXPECT_EQ(report.commands, 0U);
}

TEST(TriggeredLoop, AStopReachesALoopThatWaitsForAPull) {
  Rig rig;
  std::stop_source stop;
  hil::Trigger trigger;
  fakes::PixelGenerator generator([&stop](const engine::Shot&) { stop.request_stop(); });
  LoopSpec spec = patient_loop(10);
  spec.trigger = &trigger;
  spec.trigger_timeout = std::chrono::hours(1);
  trigger.pull();
  trigger.pull();
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, rig.sink, rig.silent);
  const LoopReport report = loop.run(stop.get_token());
  EXPECT_EQ(report.due, 1U);
  EXPECT_FALSE(report.trigger_missing);
}

TEST(Lockstep, AnAnswerInSeveralPacketsIsWholeWithTheLast) {
  Rig rig;
  fakes::PixelGenerator generator;
  fakes::QueueSource source;
  fakes::Sink sink([&source](const Frame& frame, Duration) -> engine::Status {
    Command command;
    command.answers_frame = frame.sequence;
    for (const bool more : {true, true, false}) {
      command.more_follow = more;
      command.kind = more ? CommandKind::kReport : CommandKind::kTrim;
      source.give(command);
    }
    return engine::Done{};
  });
  LoopSpec spec = patient_loop(5);
  spec.answer_timeout = std::chrono::seconds(20);
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.commands, 15U);
  // All three are obeyed before the next frame: had the first ended the wait, some came later.
  for (hil::CommandRecord r; loop.commands().pop(r);)
    EXPECT_EQ(r.frame, r.command.answers_frame + 1);
}

/// Numbered by hand: the fakes' queue numbers what it is given.
class HandNumbered final : public hil::CommandSource {
 public:
  explicit HandNumbered(std::vector<Command> commands) : commands_(std::move(commands)) {}
  engine::Expected<Command> receive(Duration timeout) noexcept override {
    if (next_ < commands_.size()) return commands_[next_++];
    done_ = true;
    return never_.receive(timeout);
  }
  [[nodiscard]] bool done() const noexcept { return done_; }

 private:
  std::vector<Command> commands_;
  std::size_t next_ = 0;
  std::atomic<bool> done_{false};
  hil::NoCommands never_;
};

Command trim_to(double offset_rad, std::uint64_t sequence) {
  Command c;
  c.sequence = sequence;
  c.kind = CommandKind::kTrim;
  c.trim_offset_rad = {offset_rad, 0.0};
  return c;
}

/// The pixels' own trim in the last frame, after the loop has heard `commands` before it.
double last_seen(const std::vector<Command>& commands, LoopReport& report, bool open_loop = false) {
  Rig rig;
  HandNumbered source(commands);
  double seen = 0;
  fakes::PixelGenerator generator([&](const engine::Shot& shot) {
    // All are in before the second frame.
    while (shot.sequence == 0 && !source.done()) std::this_thread::yield();
    seen = shot.attitude.middle.axes.matrix(0, 0);
  });
  LoopSpec spec = patient_loop(3);
  spec.open_loop = open_loop;
  FrameLoop loop(spec, rig.clock, rig.pointing, generator, rig.sink, source);
  report = loop.run({});
  return seen;
}

TEST(LoopGate, ADuplicateALateAndAStaleCommandChangeNothingAndAreCountedByCause) {
  Command stale = trim_to(4.0, 12);
  stale.made_at = kStart - 10 * kPeriod;
  stale.time_to_live = kMillisecond;
  Command from_the_future = trim_to(5.0, 13);
  from_the_future.made_at = kStart + std::chrono::hours(1);
  LoopReport report;
  const double seen = last_seen(
      {trim_to(1.0, 10), trim_to(2.0, 10), trim_to(3.0, 9), stale, from_the_future}, report);
  EXPECT_EQ(seen, 1.0);
  EXPECT_EQ(report.commands, 1U);
  for (const hil::Refusal cause : {hil::Refusal::kDuplicate, hil::Refusal::kReordered,
                                   hil::Refusal::kStale, hil::Refusal::kFuture})
    EXPECT_EQ(report.refused[cause], 1U) << name(cause);
  EXPECT_EQ(report.refused.total(), 4U);
}

TEST(OpenLoop, ATrimCountsAsAReport) {
  LoopReport report;
  EXPECT_EQ(last_seen({trim_to(1.0, 1)}, report, true), 0.0);
  EXPECT_EQ(report.commands, 1U);
  EXPECT_EQ(last_seen({trim_to(1.0, 1)}, report, false), 1.0);
}

TEST(LateFrames, AFrameThatTookTooLongIsOurOwnDoing) {
  Rig rig;
  fakes::PixelGenerator generator([&rig](const engine::Shot& shot) {
    if (shot.sequence == 3) rig.clock.pass(kPeriod * 5 / 2);
  });
  FrameLoop loop(patient_loop(10), rig.clock, rig.pointing, generator, rig.sink, rig.silent);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.late_by_cause[static_cast<std::size_t>(LateCause::kOwnWork)], 1U);
  for (FrameRecord r; loop.frames().pop(r);)
    EXPECT_EQ(r.late_cause, r.skipped_before > 0 ? LateCause::kOwnWork : LateCause::kNone);
}

TEST(LateFrames, AWakeUpThatComesLateWhileNothingOfOursRunsIsTheMachines) {
  Rig rig;
  fakes::HookedClock clock(kStart - kPeriod, {}, 2 * kMillisecond);
  fakes::PixelGenerator generator;
  LoopSpec spec = patient_loop(10);
  spec.command_lead = Duration{};
  FrameLoop loop(spec, clock, rig.pointing, generator, rig.sink, rig.silent);
  const LoopReport report = loop.run({});
  EXPECT_EQ(report.late, 10U);
  EXPECT_EQ(report.late_by_cause[static_cast<std::size_t>(LateCause::kMachine)], 10U);
}

}  // namespace
