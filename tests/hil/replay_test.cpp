// A run, its log, and the run again from the log alone: bit for bit.

#include <algorithm>
#include <atomic>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "engine/render/path_tracer.h"
#include "hil/closed_loop_pointing.h"
#include "hil/no_commands.h"
#include "hil/recorder.h"
#include "tests/support/fakes.h"
#include "tests/support/scenes.h"
#include "tests/support/temp_file.h"

namespace {

using engine::Duration;
using engine::SimTime;
using hil::Command;
using hil::CommandKind;
using hil::Frame;
using hil::FrameLoop;
using hil::LoopReport;
using hil::LoopSpec;
using hil::Recorder;
using hil::Recording;
using hil::WhenBusy;
using test_support::TempFile;

constexpr Duration kPeriod{100'000'000};
const SimTime kStart = engine::sim_time(1000.0);

/// Two axes that take their time: what they do depends on when they are asked, as in a real stage.
class SlowPointing final : public hil::PointingSource {
 public:
  SlowPointing() : axes_{hil::Actuator(spec()), hil::Actuator(spec())} {}

  [[nodiscard]] engine::CameraAttitude attitude(SimTime t) noexcept override {
    engine::CameraAttitude attitude;
    for (std::size_t i = 0; i < 2; ++i) {
      axes_[i].advance_to(t);
      attitude.axes.matrix(0, static_cast<Eigen::Index>(i)) = axes_[i].angle_rad();
    }
    return attitude;
  }
  void apply(const Command& c) noexcept override {
    if (c.kind != CommandKind::kTrim) return;
    for (std::size_t i = 0; i < 2; ++i)
      axes_[i].follow(c.trim_offset_rad[i], c.trim_rate_rad_s[i], c.reference);
  }
  [[nodiscard]] hil::TrimAngles trim_rad() const noexcept override {
    return {axes_[0].angle_rad(), axes_[1].angle_rad()};
  }

 private:
  static hil::ActuatorSpec spec() {
    hil::ActuatorSpec spec;
    spec.rate_limit_rad_s = 1.0;
    spec.acceleration_limit_rad_s2 = 100.0;
    return spec;
  }
  std::array<hil::Actuator, 2> axes_;
};

LoopSpec small_loop(std::uint64_t frames) {
  LoopSpec spec;
  spec.start = kStart;
  spec.period = kPeriod;
  spec.frames = frames;
  spec.width_px = 8;
  spec.height_px = 2;
  return spec;
}

Command trim(std::uint64_t sequence, SimTime reference) {
  Command c;
  c.sequence = sequence;
  c.kind = CommandKind::kTrim;
  c.trim_offset_rad = {1e-3 * static_cast<double>(sequence % 17), -2e-3};
  c.trim_rate_rad_s = {1e-4, 1e-3 * static_cast<double>(sequence % 5)};
  c.reference = reference;
  return c;
}

struct Flown {
  LoopReport report;
  std::vector<engine::Shot> shots;
};

/// Pops what the loop says in the order in which a log wants it.
void watch(FrameLoop& loop, Recorder& recorder) {
  const auto commands = [&] {
    for (hil::CommandRecord c; loop.commands().pop(c);) recorder.log(c);
  };
  for (hil::FrameRecord r; loop.frames().pop(r);) {
    commands();
    recorder.log(r);
  }
  commands();
}

Flown replay(const Recording& log) {
  LoopSpec spec = log.start.loop;
  spec.replay = &log.decisions;
  spec.frames = log.end ? log.end->loop.due : log.decisions.due.back().frame + 1;
  hil::ManualClock clock(spec.start - spec.period);
  SlowPointing pointing;
  fakes::PixelGenerator generator;
  // The cable is as slow as it likes: it decides nothing any more.
  fakes::Sink sink([&](const Frame& frame, Duration) -> engine::Status {
    if (frame.sequence % 5 == 0) std::this_thread::yield();
    return engine::Done{};
  });
  hil::NoCommands source;
  auto loop = std::make_unique<FrameLoop>(spec, clock, pointing, generator, sink, source);
  Flown out;
  out.report = loop->run({});
  out.shots = generator.shots();
  return out;
}

void expect_same_bits(const engine::Shot& a, const engine::Shot& b) {
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.shutter_open, b.shutter_open);
  EXPECT_EQ(a.exposure, b.exposure);
  EXPECT_EQ(a.attitude.open.axes.matrix, b.attitude.open.axes.matrix) << a.sequence;
  EXPECT_EQ(a.attitude.middle.axes.matrix, b.attitude.middle.axes.matrix) << a.sequence;
  EXPECT_EQ(a.attitude.close.axes.matrix, b.attitude.close.axes.matrix) << a.sequence;
}

void expect_same_run(const Flown& run, const Flown& again) {
  EXPECT_EQ(again.report.due, run.report.due);
  EXPECT_EQ(again.report.skipped, run.report.skipped);
  EXPECT_EQ(again.report.dropped, run.report.dropped);
  EXPECT_EQ(again.report.commands, run.report.commands);
  EXPECT_EQ(again.report.sent + again.report.faults, run.report.sent + run.report.faults);
  ASSERT_EQ(again.shots.size(), run.shots.size());
  for (std::size_t i = 0; i < run.shots.size(); ++i) expect_same_bits(run.shots[i], again.shots[i]);
}

/// Follows a loop on a thread of its own until it is through.
class Watched {
 public:
  Watched(FrameLoop& loop, Recorder& recorder)
      : thread_([&loop, &recorder](const std::stop_token& stop) {
          // The last look comes after the stop.
          for (bool last = false; !last; std::this_thread::yield()) {
            last = stop.stop_requested();
            watch(loop, recorder);
          }
        }) {}

 private:
  std::jthread thread_;
};

/// A clock that is late at random, a sink that is busy for ten frames of every twenty, and commands
/// that come whenever: all of it forced, so that there is something to replay.
Flown fly_badly(const std::string& log_path, std::uint64_t seed) {
  hil::LogStart start;
  start.loop = small_loop(195);
  std::uint64_t state = seed;
  const auto chance = [&state](std::uint64_t n) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (state >> 33) % n;
  };
  fakes::QueueSource source;
  std::uint64_t commands = 0;
  std::atomic<std::int64_t> reached{0};  // by the clock, in periods
  std::atomic<std::size_t> exposed{0};
  std::atomic<std::size_t> sent{0};
  fakes::HookedClock clock(
      kStart - kPeriod,
      [&](SimTime until) {
        reached = (until - kStart) / kPeriod;
        // While the sink is not busy it keeps up, however rarely its thread gets a processor.
        while (reached % 20 >= 10 && sent < exposed) std::this_thread::yield();
        if (chance(3) != 0) return;
        for (std::uint64_t n = chance(4); n > 0; --n) source.give(trim(commands++, until));
        source.wait_until_taken();
      },
      kPeriod / 400);
  SlowPointing pointing;
  fakes::PixelGenerator generator([&](const engine::Shot& shot) {
    if (chance(8) == 0) static_cast<void>(clock.sleep_until(shot.shutter_open + kPeriod * 5 / 2));
    ++exposed;
  });
  Recorder recorder({.log_path = log_path, .when_busy = WhenBusy::kWait}, start, nullptr);
  fakes::Sink sink([&](const Frame& frame, Duration timeout) -> engine::Status {
    const auto round = static_cast<std::int64_t>(frame.sequence / 20 * 20);
    while (frame.sequence % 20 < 10 && reached < round + 10) std::this_thread::yield();
    const engine::Status status = recorder.send(frame, timeout);
    ++sent;
    return status;
  });
  auto loop = std::make_unique<FrameLoop>(start.loop, clock, pointing, generator, sink, source);
  Flown out;
  {
    const Watched watched(*loop, recorder);
    out.report = loop->run({});
  }
  EXPECT_EQ(recorder.finish(out.report).records_lost, 0U);
  EXPECT_EQ(out.report.records_lost, 0U);
  out.shots = generator.shots();
  return out;
}

TEST(Replay, ALateLoopABusyLinkAndCommandsAtAnyTimeComeBackBitForBit) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const TempFile file("record.slog");
    const Flown run = fly_badly(file.path(), seed);
    // Otherwise there would be nothing to it.
    EXPECT_GT(run.report.skipped, 5U);
    EXPECT_GT(run.report.dropped, 5U);
    EXPECT_GT(run.report.commands, 50U);
    EXPECT_GT(run.shots.size(), 50U);
    const Recording log = hil::load_recording(file.path());
    ASSERT_EQ(log.fault, "");
    ASSERT_TRUE(log.end);
    EXPECT_EQ(log.frames.size(), run.shots.size());
    expect_same_run(run, replay(log));
  }
}

TEST(Replay, LockstepComesBackWithNobodyToAnswer) {
  const TempFile file("record.slog");
  hil::LogStart start;
  start.loop = small_loop(60);
  start.loop.when_busy = WhenBusy::kWait;
  start.loop.answer_timeout = std::chrono::seconds(20);
  start.loop.send_timeout = std::chrono::seconds(20);
  hil::ManualClock clock(kStart - kPeriod);
  SlowPointing pointing;
  fakes::PixelGenerator generator;
  Recorder recorder({.log_path = file.path(), .when_busy = WhenBusy::kWait}, start, nullptr);
  fakes::Device device([&](const Frame& frame) {
    EXPECT_TRUE(recorder.send(frame, std::chrono::seconds(20)).ok());
    Command answer = trim(frame.sequence, frame.shutter_open);
    answer.answers_frame = frame.sequence;
    return answer;
  });
  auto loop = std::make_unique<FrameLoop>(start.loop, clock, pointing, generator, device, device);
  Flown run;
  {
    const Watched watched(*loop, recorder);
    run.report = loop->run({});
  }
  static_cast<void>(recorder.finish(run.report));
  run.shots = generator.shots();
  EXPECT_EQ(run.report.commands, 60U);
  expect_same_run(run, replay(hil::load_recording(file.path())));
}

// What a killed program leaves: wherever the log ends, the frames that it decided come back.
TEST(Replay, ALogThatIsCutAnywhereGivesTheFramesItDecided) {
  const TempFile file("record.slog");
  const Flown run = fly_badly(file.path(), 3);
  std::string all;
  {
    std::ifstream in(file.path(), std::ios::binary);
    all.assign(std::istreambuf_iterator<char>(in), {});
  }
  std::size_t most = 0;
  for (std::size_t size = all.size(); size > 997; size -= 997) {
    const TempFile cut("cut.slog", std::string_view(all).substr(0, size));
    Recording log;
    try {
      log = hil::load_recording(cut.path());
    } catch (const engine::ConfigError&) {
      break;  // not even its start is whole
    }
    if (log.decisions.due.empty()) continue;
    const Flown again = replay(log);
    ASSERT_LE(again.shots.size(), run.shots.size());
    for (std::size_t i = 0; i < again.shots.size(); ++i)
      expect_same_bits(run.shots[i], again.shots[i]);
    if (!log.end) most = std::max(most, again.shots.size());
  }
  EXPECT_GT(most, run.shots.size() * 3 / 4);
}

// The counter-example: what is compared does see a decision that was another.
TEST(Replay, AnotherDecisionMakesOtherBits) {
  const TempFile file("record.slog");
  const Flown run = fly_badly(file.path(), 4);
  const Recording log = hil::load_recording(file.path());
  const auto differs = [&run](const Recording& other) {
    const Flown again = replay(other);
    for (const engine::Shot& a : again.shots)
      for (const engine::Shot& b : run.shots)
        if (a.sequence == b.sequence &&
            a.attitude.middle.axes.matrix != b.attitude.middle.axes.matrix)
          return true;
    return false;
  };
  EXPECT_FALSE(differs(log));
  Recording other = log;
  // One that stands: the last of its slot.
  auto& commands = other.decisions.commands;
  std::size_t i = 20;
  while (commands[i + 1].frame == commands[i].frame) ++i;
  commands[i].command.trim_offset_rad[0] += 1e-12;
  EXPECT_TRUE(differs(other)) << "a picoradian in a command";
  Recording skipped = log;
  const auto dropped = std::find_if(skipped.decisions.due.begin(), skipped.decisions.due.end(),
                                    [](const auto& d) { return !d.exposed; });
  ASSERT_NE(dropped, skipped.decisions.due.end());
  // A dropped frame asks the pointing once, a skipped one never.
  skipped.decisions.due.erase(dropped, skipped.decisions.due.end() - 20);
  EXPECT_TRUE(differs(skipped)) << "dropped frames taken for skipped ones";
}

/// The render's stopwatch: each look moves it on.
Duration g_stopwatch{};
Duration g_step{};
Duration ticking() noexcept { return g_stopwatch += g_step; }

/// A corner of two plates by the path tracer, its light in the pixels. Before each frame the
/// machine gets slower or faster.
class TracingGenerator final : public engine::SceneGenerator {
 public:
  explicit TracingGenerator(Duration (*clock)() noexcept)
      : pool_(1), tracer_(spec(clock), target(), pool_) {}

  engine::FrameReport expose(const engine::Shot& shot, engine::Budget budget, engine::DnImage& out,
                             engine::TruthMask& /*mask*/) noexcept override {
    budgets.push_back(budget);
    g_step = Duration(100'000) * (std::int64_t{1} << (shot.sequence * 5 % 7));
    engine::Snapshot snapshot = test_support::look_at_origin({136e3, 34e3, 85e3}, {0, 0, 1});
    snapshot.sun = {engine::direction_of<engine::BodyFrame>({-0.2, 0.3, 1}), 600.0};
    snapshot.sequence = shot.sequence;
    engine::FrameReport report;
    report.render = tracer_.render(snapshot, budget, light_);
    std::size_t i = 0;
    for (std::uint16_t& dn : out.pixels()) {
      // All bits of four cells of each pixel.
      std::uint32_t bits = 0;
      for (int k = 0; k < 4 && i < light_.grid.pixels().size(); ++k)
        bits = bits * 31 + std::bit_cast<std::uint32_t>(light_.grid.pixels()[i++]);
      dn = static_cast<std::uint16_t>(bits ^ bits >> 16U);
    }
    return report;
  }
  std::vector<engine::Budget> budgets;

 private:
  static engine::RenderSpec spec(Duration (*clock)() noexcept) {
    engine::RenderSpec spec;
    spec.camera = test_support::small_camera(32);
    spec.grid.beyond_frame_px = 0;
    spec.samples_per_pixel = 576;  // passes of 1, 1, 2, 4, 8, 16
    spec.clock = clock;
    return spec;
  }
  static std::shared_ptr<engine::TracedTarget> target() {
    engine::Mesh mesh;
    test_support::add_plate(mesh, "grey", {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
    test_support::add_plate(mesh, "grey", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
    return std::make_shared<engine::TracedTarget>(
        mesh, std::vector<engine::Material>{test_support::lambert_material("grey", 0.5)});
  }
  engine::WorkerPool pool_;
  engine::PathTracer tracer_;
  engine::Radiance light_;
};

TEST(Replay, FramesThatADeadlineStoppedComeBackBitForBit) {
  constexpr std::uint64_t kFrames = 21;
  const TempFile file("record.slog");
  hil::LogStart start;
  start.loop = small_loop(kFrames);
  start.loop.width_px = 48;
  start.loop.height_px = 48;
  start.loop.when_busy = WhenBusy::kWait;
  start.loop.render_time = Duration(20'000'000);
  hil::ManualClock clock(kStart - kPeriod);
  SlowPointing pointing;
  TracingGenerator generator(&ticking);
  Recorder recorder({.log_path = file.path(), .when_busy = WhenBusy::kWait}, start, nullptr);
  fakes::Sink sink(
      [&](const Frame& frame, Duration timeout) { return recorder.send(frame, timeout); });
  hil::NoCommands source;
  auto loop = std::make_unique<FrameLoop>(start.loop, clock, pointing, generator, sink, source);
  {
    const Watched watched(*loop, recorder);
    static_cast<void>(recorder.finish(loop->run({})));
  }
  for (const engine::Budget& budget : generator.budgets) {
    EXPECT_EQ(budget.time, start.loop.render_time);
    EXPECT_EQ(budget.passes, 0);
  }

  const Recording log = hil::load_recording(file.path());
  ASSERT_EQ(log.decisions.due.size(), kFrames);
  ASSERT_EQ(log.frames.size(), kFrames);
  const auto [least, most] = std::ranges::minmax_element(
      log.decisions.due, {}, [](const hil::Decisions::Due& d) { return d.passes; });
  EXPECT_LT(least->passes, 4);
  EXPECT_EQ(most->passes, 6);

  // Once as it was, on a machine without a clock; once with three passes each.
  for (const bool as_it_was : {true, false}) {
    Recording told = log;
    if (!as_it_was) {
      for (hil::Decisions::Due& d : told.decisions.due) d.passes = 3;
    }
    LoopSpec spec = log.start.loop;
    spec.replay = &told.decisions;
    spec.when_busy = WhenBusy::kWait;
    hil::ManualClock other_clock(spec.start - spec.period);
    SlowPointing other_pointing;
    TracingGenerator again(nullptr);
    std::size_t equal = 0;
    fakes::Sink comparison([&](const Frame& frame, Duration) -> engine::Status {
      const hil::LogFrame now = hil::log_frame(frame);
      equal += now.pixels_crc32c == log.frames[frame.sequence].pixels_crc32c ? 1U : 0U;
      return engine::Done{};
    });
    auto replay =
        std::make_unique<FrameLoop>(spec, other_clock, other_pointing, again, comparison, source);
    static_cast<void>(replay->run({}));
    for (std::size_t i = 0; i < kFrames; ++i) {
      EXPECT_EQ(again.budgets[i].passes, told.decisions.due[i].passes);
      EXPECT_EQ(again.budgets[i].time, Duration{});
    }
    const auto of_three = static_cast<std::size_t>(std::ranges::count(
        log.decisions.due, 3, [](const hil::Decisions::Due& d) { return d.passes; }));
    EXPECT_EQ(equal, as_it_was ? kFrames : of_three);
  }
}

}  // namespace
