// starloop replay: a recorded run again, from its log alone.

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "hil/run_log.h"
#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::content_of;
using program::Outcome;
using program::starloop;
using program::TemporaryFolder;

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";
constexpr int kGood = 0;
constexpr int kCriterionFailed = 1;
constexpr int kBadInput = 2;

/// A run of few samples through a small camera, recorded in a folder of its own.
class Recorded {
 public:
  explicit Recorded(const std::vector<std::string>& settings) {
    // A copy, gone after the run: a log needs no file but itself.
    const fs::path scenario = folder_.path() / "pass.toml";
    fs::copy_file(kFlyby, scenario);
    std::vector<std::string> arguments = {"run", scenario, "--quiet", "--out",
                                          (folder_.path() / "out").string()};
    std::vector<std::string> all = {"camera.width_px=128",        "camera.height_px=128",
                                    "render.samples_per_pixel=4", "optics.largest_wing_px=16",
                                    "guidance.error_x_urad=5",    "criteria.pointing_rms_px=0"};
    all.insert(all.end(), settings.begin(), settings.end());
    for (const std::string& setting : all) {
      arguments.emplace_back("--set");
      arguments.push_back(setting);
    }
    run = starloop(arguments);
    fs::remove(scenario);
  }
  [[nodiscard]] fs::path folder() const { return folder_.path() / "out" / "latest"; }
  [[nodiscard]] std::string log() const { return folder() / "record.slog"; }

  Outcome run;

 private:
  TemporaryFolder folder_;
};

Outcome replay(const std::string& log, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {"replay", log, "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return starloop(arguments);
}

/// The same log with some records changed, and every checksum right.
void rewrite(const std::string& from, const std::string& to,
             const std::function<void(std::uint32_t type, hil::LogBytes& payload)>& change) {
  hil::RawLogReader reader(from);
  hil::RawLog log(to, {});
  for (hil::RawRecord record; reader.next(record);) {
    hil::LogBytes payload(record.payload.begin(), record.payload.end());
    change(record.type, payload);
    ASSERT_TRUE(log.append(record.type, payload).ok());
  }
}

constexpr auto kStart = static_cast<std::uint32_t>(hil::LogType::kStart);
constexpr auto kFrame = static_cast<std::uint32_t>(hil::LogType::kFrame);

TEST(StarloopReplay, ARunInRealTimeComesBackToTheBitOnAnyNumberOfThreads) {
  const Recorded run({"run.duration_s=3", "record.frames=none"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  const hil::Recording log = hil::load_recording(run.log());
  EXPECT_EQ(log.fault, "");
  ASSERT_TRUE(log.end);
  const auto report = nlohmann::json::parse(content_of(run.folder() / "report.json"));
  // However slow the machine was, all of it is in the log.
  EXPECT_EQ(log.end->loop.due, 31U);
  EXPECT_EQ(log.end->loop.skipped, report.at("frames").at("skipped"));
  EXPECT_EQ(log.frames.size(), report.at("frames").at("sent").get<std::size_t>() +
                                   report.at("frames").at("faults").get<std::size_t>());
  EXPECT_EQ(log.decisions.commands.size(), report.at("commands").at("taken").get<std::size_t>());
  ASSERT_GT(log.frames.size(), 3U);
  ASSERT_GT(log.decisions.commands.size(), 0U);
  const std::string n = std::to_string(log.frames.size());
  for (const std::string threads : {"1", "2"}) {
    const Outcome again = replay(run.folder(), {"--threads", threads});
    EXPECT_EQ(again.exit_code, kGood) << again.err;
    EXPECT_EQ(again.out, n + " of " + n + " frames equal\n");
  }
}

TEST(StarloopReplay, FramesThatADeadlineStoppedComeBackToTheBit) {
  const Recorded run({"run.duration_s=1", "record.frames=none", "render.samples_per_pixel=400",
                      "render.deadline_ms=2"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  const hil::Recording log = hil::load_recording(run.log());
  // However many the machine had time for, each exposed frame of a target says so.
  EXPECT_TRUE(std::ranges::any_of(log.decisions.due, [](const auto& d) { return d.exposed; }));
  for (const hil::Decisions::Due& d : log.decisions.due) {
    EXPECT_EQ(d.passes > 0, d.exposed);
  }
  const std::string n = std::to_string(log.frames.size());
  EXPECT_EQ(replay(run.folder()).out, n + " of " + n + " frames equal\n");
}

TEST(StarloopReplay, LockstepComesBackAndItsPicturesToo) {
  const Recorded run({"run.clock=lockstep", "run.duration_s=0.5", "run.record_every=1"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  const fs::path out = run.folder() / "again";
  const Outcome again = replay(run.log(), {"--out", out});
  EXPECT_EQ(again.exit_code, kGood) << again.err;
  EXPECT_EQ(again.out, "6 of 6 frames equal\n");
  for (std::uint64_t k = 0; k < 6; ++k) {
    const std::string name = "frame_00000" + std::to_string(k) + ".png";
    EXPECT_TRUE(content_of(out / name) == content_of(run.folder() / name)) << name;
  }
  for (const std::string form : {"fits", "cube", "raw"})
    EXPECT_EQ(replay(run.log(), {"--out", out, "--frames", form}).exit_code, kGood);
  EXPECT_TRUE(fs::exists(out / "frame_000005.fits"));
  EXPECT_TRUE(fs::exists(out / "frames.fits"));
  EXPECT_TRUE(hil::recorded_pixels(out / "frames.slog", 5));
}

TEST(StarloopReplay, WhatIsKeptOnTheBodyFromFrameToFrameComesBackToo) {
  const Recorded run({"render.method=lattice", "render.lattice=2x2", "run.duration_s=1.5",
                      "camera.width_px=96", "camera.height_px=96"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  EXPECT_EQ(replay(run.log(), {"--threads", "1"}).exit_code, kGood);
  EXPECT_EQ(replay(run.log(), {"--threads", "3"}).exit_code, kGood);
}

TEST(StarloopReplay, AnAlteredFrameIsNamedWithWhatDiffers) {
  const Recorded run(
      {"run.clock=lockstep", "run.duration_s=0.5", "run.record_every=1", "record.frames=raw"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  const std::string altered = run.folder() / "altered.slog";
  rewrite(run.log(), altered, [frame = 0](std::uint32_t type, hil::LogBytes& payload) mutable {
    // The checksum of the pixels is a note's last number.
    if (type == kFrame && frame++ == 3) payload.back() ^= std::byte{1};
  });
  const Outcome one = replay(altered);
  EXPECT_EQ(one.exit_code, kCriterionFailed);
  EXPECT_NE(one.out.find("5 of 6 frames equal\nframe 3 is the first that differs\n"),
            std::string::npos)
      << one.out;
  EXPECT_NE(one.out.find("the log is at fault"), std::string::npos) << one.out;

  // Another scenario makes other pixels, and those that were kept say which.
  rewrite(run.log(), altered, [&](std::uint32_t type, hil::LogBytes& payload) {
    if (type != kStart) return;
    hil::LogStart start = hil::load_recording(run.log()).start;
    start.overrides.emplace_back("detector.read_noise_e=9");
    hil::encode(start, payload);
  });
  const Outcome all = replay(altered);
  EXPECT_EQ(all.exit_code, kCriterionFailed);
  EXPECT_NE(all.out.find("0 of 6 frames equal\nframe 0 is the first that differs\n"),
            std::string::npos)
      << all.out;
  EXPECT_NE(all.out.find(" DN differ; the first at column "), std::string::npos) << all.out;

  // A mesh that has gone since is named.
  rewrite(run.log(), altered, [&](std::uint32_t type, hil::LogBytes& payload) {
    if (type != kStart) return;
    hil::LogStart start = hil::load_recording(run.log()).start;
    start.overrides.emplace_back("target.mesh=/nowhere/gone.obj");
    hil::encode(start, payload);
  });
  const Outcome gone = replay(altered);
  EXPECT_EQ(gone.exit_code, kBadInput);
  EXPECT_NE(gone.err.find("/nowhere/gone.obj"), std::string::npos) << gone.err;
}

TEST(StarloopReplay, ALogThatWasCutShortIsReplayedAsFarAsItGoes) {
  const Recorded run({"run.clock=lockstep", "run.duration_s=0.9", "record.frames=none"});
  ASSERT_EQ(run.run.exit_code, kGood) << run.run.err;
  const std::string all = content_of(run.log());
  const hil::Recording whole = hil::load_recording(run.log());
  ASSERT_EQ(whole.frames.size(), 10U);
  const std::string cut = run.folder() / "cut.slog";
  // Without its end record and the half of the rest.
  const std::size_t size = all.size() - 900;
  std::ofstream(cut, std::ios::binary) << all.substr(0, size);
  const hil::Recording log = hil::load_recording(cut);
  ASSERT_GT(log.decisions.due.size(), 1U);
  ASSERT_LT(log.decisions.due.size(), 10U);
  const Outcome again = replay(cut);
  EXPECT_EQ(again.exit_code, kGood) << again.out << again.err;
  EXPECT_NE((again.out + again.err).find("no end: the run was cut short"), std::string::npos);
  const std::string n = std::to_string(std::min(log.decisions.due.size(), log.frames.size()));
  EXPECT_NE(again.out.find(n + " of " + n + " frames equal"), std::string::npos) << again.out;
}

TEST(StarloopReplay, WhatIsNoLogIsBadInput) {
  const TemporaryFolder folder;
  for (const std::string& path : {kFlyby, folder.path().string(), std::string("/nowhere")}) {
    const Outcome run = replay(path);
    EXPECT_EQ(run.exit_code, kBadInput);
    EXPECT_NE(run.err.find("expected the log of a run"), std::string::npos) << run.err;
  }
  EXPECT_EQ(starloop({"replay"}).exit_code, kBadInput);
}

}  // namespace
