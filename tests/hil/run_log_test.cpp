#include "hil/run_log.h"

#include <bit>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temp_file.h"

namespace {

using engine::Duration;
using engine::sim_time;
using engine::SimTime;
using hil::Command;
using hil::CommandKind;
using hil::CommandRecord;
using hil::LogBytes;
using hil::LogDecision;
using hil::LogFrame;
using hil::LogStart;
using hil::LogType;
using hil::RawLog;
using hil::Recording;
using test_support::TempFile;

LogStart small_start() {
  LogStart start;
  start.program = "starloop 0.1.0";
  start.scenario_file = "config/small.toml";
  start.scenario = "[run]\npass = 3\n";
  start.overrides = {"run.clock=lockstep", "detector.bits=12"};
  start.seed = 0xFEDCBA9876543210ULL;
  start.threads = 2;
  start.loop.start = SimTime(Duration(309'761'630'162'629));
  start.loop.period = Duration(10'000'001);
  start.loop.frames = 100;
  start.loop.exposure = Duration(1'000'003);
  start.loop.command_lead = Duration(9'000'000 - 7);
  start.loop.width_px = 640;
  start.loop.height_px = 480;
  start.loop.bits = 12;
  return start;
}

template <class Payload>
void append(RawLog& log, LogType type, const Payload& payload) {
  LogBytes bytes;
  hil::encode(payload, bytes);
  ASSERT_TRUE(log.append(static_cast<std::uint32_t>(type), bytes).ok());
}

LogDecision decided(std::uint64_t frame, bool exposed = true) {
  LogDecision d;
  d.kind = exposed ? LogDecision::Kind::kExposed : LogDecision::Kind::kDropped;
  d.frame = frame;
  return d;
}

TEST(RunLog, TheStartSaysAllThatItWasTold) {
  const TempFile file("start.slog");
  const LogStart sent = small_start();
  {
    RawLog log(file.path(), Duration{});
    append(log, LogType::kStart, sent);
  }
  const Recording got = hil::load_recording(file.path());
  EXPECT_EQ(got.start.program, sent.program);
  EXPECT_EQ(got.start.scenario_file, sent.scenario_file);
  EXPECT_EQ(got.start.scenario, sent.scenario);
  EXPECT_EQ(got.start.overrides, sent.overrides);
  EXPECT_EQ(got.start.seed, sent.seed);
  EXPECT_EQ(got.start.threads, sent.threads);
  EXPECT_EQ(got.start.loop.start, sent.loop.start);
  EXPECT_EQ(got.start.loop.period, sent.loop.period);
  EXPECT_EQ(got.start.loop.frames, sent.loop.frames);
  EXPECT_EQ(got.start.loop.exposure, sent.loop.exposure);
  EXPECT_EQ(got.start.loop.command_lead, sent.loop.command_lead);
  EXPECT_EQ(got.start.loop.width_px, 640);
  EXPECT_EQ(got.start.loop.height_px, 480);
  EXPECT_EQ(got.start.loop.bits, 12);
  EXPECT_FALSE(got.end);
  EXPECT_EQ(got.records, 1U);
  EXPECT_EQ(got.fault, "");
}

// A packet rounds a life to milliseconds and a quaternion to length one: a replay may not.
TEST(RunLog, CommandsComeBackToTheLastBit) {
  const TempFile file("commands.slog");
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  std::vector<CommandRecord> sent;
  for (std::uint64_t i = 0; i < 700; ++i) {
    CommandRecord r;
    r.frame = i / 7;
    Command& c = r.command;
    c.sequence = random();
    c.answers_frame = random();
    c.kind = static_cast<CommandKind>(i % hil::kCommandKinds);
    c.more_follow = i % 2 == 0;
    c.made_at = SimTime(Duration(static_cast<std::int64_t>(random() >> 2)));
    c.time_to_live = Duration(static_cast<std::int64_t>(random() % 1'000'000'000));
    c.sender = static_cast<std::uint32_t>(random());
    if (c.kind == CommandKind::kTrim) c.trim_offset_rad = {number(random), number(random)};
    if (c.kind == CommandKind::kTrim || c.kind == CommandKind::kRate)
      c.trim_rate_rad_s = {number(random), number(random)};
    if (c.kind == CommandKind::kAttitude) {
      auto& q = c.attitude.j2000_to_camera;
      for (double& x : q) x = number(random) + 1.5;
      const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
      for (double& x : q) x /= length;
      c.attitude.rate_rad_s = {number(random), number(random), number(random)};
    }
    if (c.kind == CommandKind::kMode) c.mode = hil::GuidanceMode::kInertial;
    c.reference = SimTime(Duration(static_cast<std::int64_t>(i)));
    c.detection.id = static_cast<std::uint32_t>(random());
    c.detection.centroid_px = {1000.0 * number(random), 1000.0 * number(random)};
    c.detection.confidence = 0.75F;
    c.detection.box_px = {1, 2, 3, 4};
    sent.push_back(r);
  }
  {
    RawLog log(file.path(), Duration{});
    append(log, LogType::kStart, small_start());
    for (const CommandRecord& r : sent) append(log, LogType::kCommand, r);
  }
  const Recording got = hil::load_recording(file.path());
  ASSERT_EQ(got.fault, "");
  ASSERT_EQ(got.decisions.commands.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    SCOPED_TRACE(i);
    const Command& a = sent[i].command;
    const Command& b = got.decisions.commands[i].command;
    EXPECT_EQ(got.decisions.commands[i].frame, sent[i].frame);
    EXPECT_EQ(b.sequence, a.sequence);
    EXPECT_EQ(b.answers_frame, a.answers_frame);
    EXPECT_EQ(b.kind, a.kind);
    EXPECT_EQ(b.more_follow, a.more_follow);
    EXPECT_EQ(b.made_at, a.made_at);
    EXPECT_EQ(b.time_to_live, a.time_to_live);
    EXPECT_EQ(b.sender, a.sender);
    EXPECT_EQ(b.trim_offset_rad, a.trim_offset_rad);
    EXPECT_EQ(b.trim_rate_rad_s, a.trim_rate_rad_s);
    EXPECT_EQ(b.attitude.j2000_to_camera, a.attitude.j2000_to_camera);
    EXPECT_EQ(b.attitude.rate_rad_s, a.attitude.rate_rad_s);
    EXPECT_EQ(b.mode, a.mode);
    EXPECT_EQ(b.detection.id, a.detection.id);
    EXPECT_EQ(b.detection.centroid_px.u, a.detection.centroid_px.u);
    EXPECT_EQ(b.detection.centroid_px.v, a.detection.centroid_px.v);
    EXPECT_EQ(b.detection.confidence, a.detection.confidence);
    EXPECT_EQ(b.detection.box_px, a.detection.box_px);
    if (a.kind == CommandKind::kTrim || a.kind == CommandKind::kRate ||
        a.kind == CommandKind::kAttitude) {
      EXPECT_EQ(b.reference, a.reference);
    }
  }
}

TEST(RunLog, PassesOfAFrameThatAClockStoppedComeBack) {
  const TempFile file("passes.slog");
  LogDecision timed = decided(1);
  timed.kind = LogDecision::Kind::kExposedInPasses;
  timed.passes = 5;
  LogDecision without = decided(3);
  without.kind = LogDecision::Kind::kExposedInPasses;
  {
    RawLog log(file.path(), Duration{});
    append(log, LogType::kStart, small_start());
    append(log, LogType::kDecision, decided(0));
    append(log, LogType::kDecision, timed);
    append(log, LogType::kDecision, decided(2, false));
    append(log, LogType::kDecision, without);  // it says that there are some, and has none
  }
  const Recording got = hil::load_recording(file.path());
  EXPECT_EQ(got.fault.find("a record that makes no sense"), 0U) << got.fault;
  ASSERT_EQ(got.decisions.due.size(), 3U);
  EXPECT_EQ(got.decisions.due[0].passes, 0);
  EXPECT_TRUE(got.decisions.due[1].exposed);
  EXPECT_EQ(got.decisions.due[1].passes, 5);
  EXPECT_FALSE(got.decisions.due[2].exposed);
}

TEST(RunLog, WhatAFrameLeftOutForWantOfTimeComesBack) {
  const TempFile file("haste.slog");
  LogDecision hasty = decided(1);
  hasty.kind = LogDecision::Kind::kExposedInHaste;
  hasty.shed = engine::Shed::kSamples;
  LogDecision both = hasty;
  both.frame = 2;
  both.passes = 3;
  LogDecision nonsense = hasty;
  nonsense.frame = 3;
  nonsense.shed = static_cast<engine::Shed>(engine::kSheds);
  {
    RawLog log(file.path(), Duration{});
    append(log, LogType::kStart, small_start());
    append(log, LogType::kDecision, hasty);
    append(log, LogType::kDecision, both);
    append(log, LogType::kDecision, nonsense);
  }
  const Recording got = hil::load_recording(file.path());
  EXPECT_EQ(got.fault.find("a record that makes no sense"), 0U) << got.fault;
  ASSERT_EQ(got.decisions.due.size(), 2U);
  EXPECT_EQ(got.decisions.due[0].shed, engine::Shed::kSamples);
  EXPECT_EQ(got.decisions.due[0].passes, 0);
  EXPECT_TRUE(got.decisions.due[1].exposed);
  EXPECT_EQ(got.decisions.due[1].passes, 3);
}

TEST(RunLog, FramesDecisionsAndTheEndComeBack) {
  const TempFile file("all.slog");
  LogFrame frame;
  frame.sequence = 7;
  frame.shutter_open = sim_time(12.5);
  frame.exposure = Duration(17);
  frame.width_px = 640;
  frame.height_px = 480;
  frame.bits = 12;
  frame.pixels_crc32c = 0xDEADBEEF;
  hil::LogEnd end;
  end.loop.due = 10;
  end.loop.sent = 6;
  end.loop.skipped = 2;
  end.loop.dropped = 1;
  end.loop.faults = 1;
  end.loop.late = 3;
  end.loop.commands = 4;
  end.loop.command_faults = 5;
  end.loop.commands_lost = 8;
  end.loop.records_lost = 9;
  end.loop.answer_missing = true;
  end.log_lost = 11;
  {
    RawLog log(file.path(), Duration{});
    append(log, LogType::kStart, small_start());
    append(log, LogType::kDecision, decided(0));
    append(log, LogType::kFrame, frame);
    append(log, LogType::kDecision, decided(3, false));
    append(log, LogType::kEnd, end);
  }
  const Recording got = hil::load_recording(file.path());
  ASSERT_EQ(got.fault, "");
  ASSERT_EQ(got.frames.size(), 1U);
  EXPECT_EQ(got.frames[0].sequence, 7U);
  EXPECT_EQ(got.frames[0].shutter_open, frame.shutter_open);
  EXPECT_EQ(got.frames[0].exposure, frame.exposure);
  EXPECT_EQ(got.frames[0].width_px, 640);
  EXPECT_EQ(got.frames[0].height_px, 480);
  EXPECT_EQ(got.frames[0].bits, 12);
  EXPECT_EQ(got.frames[0].pixels_crc32c, 0xDEADBEEFU);
  ASSERT_EQ(got.decisions.due.size(), 2U);
  EXPECT_EQ(got.decisions.due[0].frame, 0U);
  EXPECT_TRUE(got.decisions.due[0].exposed);
  EXPECT_EQ(got.decisions.due[1].frame, 3U);
  EXPECT_FALSE(got.decisions.due[1].exposed);
  ASSERT_TRUE(got.end);
  const hil::LoopReport& l = got.end->loop;
  const std::vector<std::uint64_t> counts = {
      l.due,      l.sent,           l.skipped,       l.dropped,      l.faults,         l.late,
      l.commands, l.command_faults, l.commands_lost, l.records_lost, got.end->log_lost};
  EXPECT_EQ(counts, (std::vector<std::uint64_t>{10, 6, 2, 1, 1, 3, 4, 5, 8, 9, 11}));
  EXPECT_TRUE(l.answer_missing);
}

// Whole in its bytes and yet impossible: a faulty writer, or a forger. A loop given it could break.
TEST(RunLog, RecordsThatMakeNoSenseEndTheReading) {
  struct Case {
    const char* name;
    std::function<void(RawLog&)> write;
    const char* fault;
  };
  const auto none = std::span<const std::byte>{};
  const std::vector<Case> cases = {
      {"frames of the past", [](RawLog& log) { append(log, LogType::kDecision, decided(5)); },
       "a record that makes no sense"},
      {"beyond the run", [](RawLog& log) { append(log, LogType::kDecision, decided(100)); },
       "a record that makes no sense"},
      {"an empty command", [&](RawLog& log) { static_cast<void>(log.append(3, none)); },
       "a record that makes no sense"},
      {"a decision of a later kind",
       [](RawLog& log) {
         LogDecision d = decided(9);
         d.kind = static_cast<LogDecision::Kind>(4);
         append(log, LogType::kDecision, d);
       },
       "a record that makes no sense"},
      {"a type of a later program", [&](RawLog& log) { static_cast<void>(log.append(77, none)); },
       "a record of an unknown type"},
      {"a second start", [](RawLog& log) { append(log, LogType::kStart, small_start()); },
       "a record of an unknown type"},
      {"a command of the past",
       [](RawLog& log) {
         append(log, LogType::kCommand, CommandRecord{8, {}});
         append(log, LogType::kCommand, CommandRecord{7, {}});
       },
       "a record that makes no sense"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const TempFile file("nonsense.slog");
    {
      RawLog log(file.path(), Duration{});
      append(log, LogType::kStart, small_start());
      append(log, LogType::kDecision, decided(5));
      c.write(log);
      append(log, LogType::kDecision, decided(50));
    }
    const Recording got = hil::load_recording(file.path());
    EXPECT_EQ(got.decisions.due.size(), 1U);
    EXPECT_EQ(got.fault.find(c.fault), 0U) << got.fault;
  }
}

TEST(RunLog, AStartThatNoLoopCouldRunIsRefused) {
  const std::vector<std::function<void(LogStart&)>> spoil = {
      [](LogStart& s) { s.loop.period = Duration{}; },
      [](LogStart& s) { s.loop.exposure = s.loop.period; },
      [](LogStart& s) { s.loop.exposure = Duration::max(); },
      [](LogStart& s) { s.loop.command_lead = Duration::min(); },
      [](LogStart& s) { s.loop.frames = ~std::uint64_t{0}; },
      [](LogStart& s) { s.loop.width_px = -1; },
      [](LogStart& s) { s.loop.height_px = 0; },
  };
  for (const auto& make_wrong : spoil) {
    const TempFile file("start.slog");
    LogStart start = small_start();
    make_wrong(start);
    {
      RawLog log(file.path(), Duration{});
      append(log, LogType::kStart, start);
    }
    EXPECT_THROW(static_cast<void>(hil::load_recording(file.path())), engine::ConfigError);
  }
}

TEST(RunLog, WhatIsNoLogOfARunIsRefusedByName) {
  const TempFile other("other.slog");
  {
    RawLog log(other.path(), Duration{});
    append(log, LogType::kDecision, decided(0));
  }
  const TempFile text("text.slog", "frame,time_s\n0,1.5\n");
  const TempFile empty("empty.slog", "");
  for (const std::string& path :
       {other.path(), text.path(), empty.path(), std::string("/nowhere/record.slog")}) {
    try {
      static_cast<void>(hil::load_recording(path));
      ADD_FAILURE() << path;
    } catch (const engine::ConfigError& e) {
      EXPECT_EQ(std::string(e.what()).find(path + ": expected the log of a run"), 0U) << e.what();
    }
  }
}

// Bytes with a right checksum and nothing else right about them.
TEST(RunLog, PayloadsOfNoiseNeverCrashTheReader) {
  std::mt19937 random(5);
  LogBytes start;
  hil::encode(small_start(), start);
  for (int i = 0; i < 2000; ++i) {
    const TempFile file("noise.slog");
    {
      RawLog log(file.path(), Duration{});
      LogBytes first = start;
      if (i % 2 == 0)
        first[random() % first.size()] = static_cast<std::byte>(random());
      else
        first.resize(random() % (first.size() + 1));
      if (i % 4 == 3) first = start;
      ASSERT_TRUE(log.append(1, first).ok());
      LogBytes noise(random() % 200);
      for (std::byte& b : noise) b = static_cast<std::byte>(random());
      ASSERT_TRUE(log.append(2 + static_cast<std::uint32_t>(i) % 4, noise).ok());
    }
    try {
      const Recording got = hil::load_recording(file.path());
      EXPECT_LE(got.records, 2U);
    } catch (const engine::ConfigError&) {
    }
  }
}

}  // namespace
