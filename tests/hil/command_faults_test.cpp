#include <memory>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/faulty_commands.h"
#include "hil/faults/faulty_sink.h"
#include "hil/frame_loop.h"
#include "tests/support/fakes.h"
#include "tests/support/faulty_line.h"

namespace {

using namespace faulty_line;
using engine::Error;
using engine::Expected;
using engine::Status;
using hil::Command;
using hil::FaultyCommands;
using hil::Frame;

Command answer(std::uint64_t frame) {
  Command c;
  c.sequence = frame;
  c.answers_frame = frame;
  c.kind = hil::CommandKind::kTrim;
  c.trim_offset_rad = {1e-5 * static_cast<double>(frame + 1), 0.0};
  c.sender = 4;
  return c;
}

/// Hands over one command after the other, and then says that nothing came.
class Script final : public hil::CommandSource {
 public:
  Expected<Command> receive(Duration /*timeout*/) noexcept override {
    if (next >= commands.size()) return Error{engine::Fault::kTimeout, 0, "script"};
    return commands[next++];
  }
  std::vector<Command> commands;
  std::size_t next = 0;
};

class Desk {
 public:
  Desk(const std::string& toml, FaultyCommands::Pace pace, std::uint64_t seed = 1)
      : spec_(faults(toml, seed)),
        news_(std::make_unique<hil::FrameNewsRing>()),
        source_(std::make_unique<FaultyCommands>(spec_, script, *news_, pace)) {}

  /// Frame k went out, its answer comes, and what the loop gets by then is kept.
  void answer_frame(std::uint64_t k, bool withheld = false) {
    EXPECT_TRUE(news_->push(
        {{k, kPeriod * static_cast<std::int64_t>(k)}, withheld, hil::FrameNews::kNothing}));
    if (!withheld) script.commands.push_back(answer(k));
    // Two silent looks: a refused command is followed by what stands in for it.
    for (int silent = 0; silent < 2;) {
      const auto got = source_->receive(kPeriod);
      if (got.ok()) {
        out.push_back(got.value());
      } else if (got.error().fault == engine::Fault::kRejected) {
        ++rejected;
      } else {
        ++silent;
      }
    }
    for (FaultRecord r; source_->records().pop(r);) records.push_back(r);
  }
  void answer_all(std::uint64_t frames) {
    for (std::uint64_t k = 0; k < frames; ++k) answer_frame(k);
  }
  /// The frames answered, in order; stand-ins as minus their frame and one.
  [[nodiscard]] std::vector<int> answered() const {
    std::vector<int> all;
    for (const Command& c : out) {
      const int frame = static_cast<int>(c.answers_frame);
      all.push_back(c.sender == FaultyCommands::kStandIn ? -frame - 1 : frame);
    }
    return all;
  }
  void expect_adds_up() const {
    const hil::CommandFaultCounts& c = source_->counts();
    EXPECT_EQ(c.taken, c.delivered + c.lost + c.refused + c.held);
    EXPECT_EQ(out.size(), c.delivered + c.copies + c.stand_ins);
  }
  [[nodiscard]] const FaultyCommands& source() const { return *source_; }

  Script script;
  std::vector<Command> out;
  std::vector<FaultRecord> records;
  int rejected = 0;

 private:
  FaultSpec spec_;
  std::unique_ptr<hil::FrameNewsRing> news_;
  std::unique_ptr<FaultyCommands> source_;
};

using Pace = FaultyCommands::Pace;

TEST(CommandFaults, WithoutAnyEveryCommandComesThroughAsItIs) {
  Desk desk("", Pace::kLockstep);
  desk.answer_all(5);
  EXPECT_EQ(desk.answered(), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(desk.out[3].trim_offset_rad, answer(3).trim_offset_rad);
  EXPECT_EQ(desk.out[3].sender, 4U);
  EXPECT_TRUE(desk.records.empty());
  desk.expect_adds_up();
}

TEST(CommandFaults, LostOnesDoNotComeAndInLockstepAnEmptyReportDoesInstead) {
  const std::string toml = "[faults.command_lost]\nfrom_s = 0.2\nto_s = 0.4";
  Desk real(toml, Pace::kRealtime);
  real.answer_all(6);
  EXPECT_EQ(real.answered(), (std::vector<int>{0, 1, 4, 5}));
  ASSERT_EQ(real.records.size(), 2U);
  EXPECT_EQ(real.records[0].frame, 2U);
  EXPECT_EQ(real.records[0].command, 2U);
  real.expect_adds_up();
  Desk lockstep(toml, Pace::kLockstep);
  lockstep.answer_all(6);
  EXPECT_EQ(lockstep.answered(), (std::vector<int>{0, 1, -3, -4, 4, 5}));
  EXPECT_EQ(lockstep.out[2].kind, hil::CommandKind::kReport);
  EXPECT_EQ(lockstep.out[2].detection.confidence, 0.0F);
  EXPECT_EQ(lockstep.records.size(), 2U);
  lockstep.expect_adds_up();
}

TEST(CommandFaults, DelayedOnesComeJustBeforeTheOneTheyAreHeldBackTo) {
  const std::string toml = "[faults.command_delayed]\ncommands = 2\nfrom_frame = 1\nto_frame = 3";
  Desk real(toml, Pace::kRealtime);
  real.answer_all(6);
  EXPECT_EQ(real.answered(), (std::vector<int>{0, 1, 3, 2, 4, 5}));
  EXPECT_EQ(real.out[1].trim_offset_rad, answer(1).trim_offset_rad);
  real.expect_adds_up();
  Desk lockstep(toml, Pace::kLockstep);
  lockstep.answer_all(6);
  EXPECT_EQ(lockstep.answered(), (std::vector<int>{0, -2, -3, 1, 3, 2, 4, 5}));
  lockstep.expect_adds_up();
}

TEST(CommandFaults, AsManyAsCanBeDelayedAreHeldAndTheRestIsCounted) {
  Desk desk("[faults.command_delayed]\ncommands = 64", Pace::kRealtime);
  desk.answer_all(200);
  EXPECT_EQ(desk.out.size(), 200U - 64U);
  EXPECT_EQ(desk.source().counts().held, 64U);
  for (std::size_t i = 0; i < desk.out.size(); ++i) EXPECT_EQ(desk.out[i].answers_frame, i);
  desk.expect_adds_up();
}

TEST(CommandFaults, DuplicatedOnesComeTwice) {
  Desk desk("[faults.command_duplicated]\nfrom_frame = 1\nto_frame = 2", Pace::kLockstep);
  desk.answer_all(3);
  EXPECT_EQ(desk.answered(), (std::vector<int>{0, 1, 1, 2}));
  EXPECT_EQ(desk.records.size(), 1U);
  desk.expect_adds_up();
}

// A CRC of 32 bits sees every error of up to three bits in so short a packet.
TEST(CommandFaults, TheChecksumRefusesEveryCorruptedPacket) {
  for (const int bits : {1, 2, 3, 64}) {
    Desk desk("[faults.command_corrupted]\nprobability = 0.5\nbits = " + std::to_string(bits),
              Pace::kLockstep);
    desk.answer_all(400);
    EXPECT_EQ(static_cast<std::size_t>(desk.rejected), desk.records.size());
    EXPECT_NEAR(desk.rejected, 200.0, five_sigma(400, 0.5));
    EXPECT_EQ(desk.source().counts().stand_ins, desk.records.size());
    EXPECT_EQ(desk.out.size(), 400U) << "each frame has its answer, or what stands in for it";
    for (const Command& c : desk.out) {
      if (c.sender != FaultyCommands::kStandIn) {
        EXPECT_EQ(c.trim_offset_rad, answer(c.answers_frame).trim_offset_rad);
      }
    }
    desk.expect_adds_up();
  }
}

TEST(CommandFaults, AFrameThatNeverWentOutIsAnsweredByAStandInInLockstepOnly) {
  for (const Pace pace : {Pace::kLockstep, Pace::kRealtime}) {
    Desk desk("[faults.dropped]\nprobability = 0.1", pace);
    desk.answer_frame(0);
    desk.answer_frame(1, true);
    desk.answer_frame(2);
    EXPECT_EQ(desk.answered(),
              pace == Pace::kLockstep ? (std::vector<int>{0, -2, 2}) : (std::vector<int>{0, 2}));
    desk.expect_adds_up();
  }
}

// ---- the whole loop -----------------------------------------------------------------------------

/// Software under test on a thread of its own, that takes now longer and now less long.
class BusyDevice final : public hil::FrameSink, public hil::CommandSource {
 public:
  BusyDevice() : thread_([this](const std::stop_token& stop) { answer_frames(stop); }) {}

  Status send(const Frame& frame, Duration /*timeout*/) noexcept override {
    ENSURE(frames_.push(frame.sequence));
    count_.release();
    return engine::Done{};
  }
  Expected<Command> receive(Duration timeout) noexcept override {
    return answers_.receive(timeout);
  }
  /// Answers what has come, and no more after that.
  std::vector<std::uint64_t> finish() {
    thread_.request_stop();
    count_.release();
    thread_.join();
    return seen_;
  }

 private:
  void answer_frames(const std::stop_token& stop) {
    std::uint64_t state = reinterpret_cast<std::uintptr_t>(this);
    for (;;) {
      count_.acquire();
      std::uint64_t frame = 0;
      if (!frames_.pop(frame)) {
        if (stop.stop_requested()) return;
        continue;
      }
      seen_.push_back(frame);
      state = state * 6364136223846793005ULL + 1442695040888963407ULL + frame;
      for (std::uint64_t n = (state >> 33) % 100; n > 0; --n) std::this_thread::yield();
      answers_.give(answer(frame));
    }
  }

  hil::SpscRing<std::uint64_t, 256> frames_;  // sender -> device
  std::counting_semaphore<> count_{0};
  fakes::QueueSource answers_;
  std::vector<std::uint64_t> seen_;
  std::jthread thread_;
};

struct LoopRun {
  hil::LoopReport report;
  std::vector<std::uint64_t> seen;  ///< by the software under test, in order
  std::vector<double> looked;       ///< where the camera pointed, frame by frame
  std::vector<std::string> faults;  ///< frames', then commands', as JSON
};

LoopRun run_lockstep(const std::string& toml) {
  const FaultSpec spec = faults(toml, 1, 8);
  LoopRun run;
  hil::LoopSpec loop_spec;
  loop_spec.start = kStart;
  loop_spec.frames = 60;
  loop_spec.width_px = 8;
  loop_spec.height_px = 2;
  loop_spec.when_busy = hil::WhenBusy::kWait;
  // Only a loop that is wrong waits this long.
  loop_spec.answer_timeout = std::chrono::seconds(20);
  loop_spec.send_timeout = std::chrono::seconds(20);
  hil::ManualClock clock(kStart - loop_spec.period);
  fakes::IdealPointing pointing;
  fakes::PixelGenerator generator;
  BusyDevice device;
  const auto sink =
      std::make_unique<FaultySink>(spec, FaultySink::Shape{8, 2}, kStart, device, nullptr);
  const auto commands =
      std::make_unique<FaultyCommands>(spec, device, sink->news(), Pace::kLockstep);
  const auto loop =
      std::make_unique<hil::FrameLoop>(loop_spec, clock, pointing, generator, *sink, *commands);
  run.report = loop->run({});
  run.seen = device.finish();
  for (const engine::Shot& shot : generator.shots())
    run.looked.push_back(shot.attitude.middle.axes.matrix(0, 0));
  for (FaultRecord r; sink->records().pop(r);) run.faults.push_back(hil::fault_json(spec, r));
  for (FaultRecord r; commands->records().pop(r);) run.faults.push_back(hil::fault_json(spec, r));
  return run;
}

TEST(FaultyLoop, LockstepGoesOnWhateverIsLostAndIsTheSameEveryTime) {
  const std::string toml = R"([faults.away]
from_frame = 20
to_frame = 25
[faults.dropped]
probability = 0.1
[faults.late]
probability = 0.4
frames = 2
[faults.duplicated]
probability = 0.2
[faults.command_lost]
probability = 0.1
[faults.command_corrupted]
probability = 0.1
[faults.command_delayed]
probability = 0.1
commands = 3
[faults.command_duplicated]
probability = 0.1)";
  const LoopRun once = run_lockstep(toml);
  EXPECT_FALSE(once.report.answer_missing);
  EXPECT_EQ(once.report.due, 60U);
  EXPECT_EQ(once.report.faults, 5U) << "away";
  EXPECT_EQ(once.report.sent, 55U);
  EXPECT_EQ(once.looked.size(), 60U);
  EXPECT_GT(once.report.command_faults, 0U);
  EXPECT_GT(once.faults.size(), 20U);
  for (int i = 0; i < 3; ++i) {
    const LoopRun again = run_lockstep(toml);
    EXPECT_EQ(again.seen, once.seen);
    EXPECT_EQ(again.looked, once.looked);
    EXPECT_EQ(again.faults, once.faults);
  }
}

TEST(FaultyLoop, ALostCommandLeavesTheCameraWhereItWas) {
  const LoopRun run = run_lockstep("[faults.command_lost]\nfrom_frame = 10\nto_frame = 13");
  // Frame k + 1 is the first to show the answer to k.
  for (std::size_t k = 1; k < 60; ++k) {
    const std::size_t answered = k - 1 >= 10 && k - 1 < 13 ? 9 : k - 1;
    EXPECT_EQ(run.looked[k], answer(answered).trim_offset_rad[0]) << k;
  }
}

}  // namespace
