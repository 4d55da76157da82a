// The program where the system says no: memory, disk, threads, signals
// (tests/support/fault_shim.cpp). Whatever happens it ends by itself, with an exit code of its own
// and a word why, and what it leaves can be read.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "hil/run_log.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;

constexpr int kGood = 0;
constexpr int kBadInput = 2;
constexpr int kDeviceFault = 3;

/// Six frames of 128 x 128, in lockstep unless told otherwise.
std::vector<std::string> small_run(const fs::path& out, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {
      STARLOOP_PROGRAM, "run",   STARLOOP_SOURCE_DIR "/config/flyby.toml",
      "--no-pictures",  "--out", out.string()};
  std::vector<std::string> sets = {
      "run.clock=lockstep",         "run.duration_s=0.5",        "run.pass=1",
      "visibility.span_days=4",     "camera.width_px=128",       "camera.height_px=128",
      "render.samples_per_pixel=1", "criteria.pointing_rms_px=0"};
  sets.insert(sets.end(), more.begin(), more.end());
  for (const std::string& set : sets) {
    words.emplace_back("--set");
    words.push_back(set);
  }
  return words;
}

struct Outcome {
  int exit_code = 0;  ///< 128 and more: a signal
  hil::Recording log;
  bool has_log = false;
};

Outcome run_with(const std::string& fault, const std::vector<std::string>& more_words = {}) {
  const TemporaryFolder folder;
  std::vector<std::string> words = small_run(folder.path());
  words.emplace_back("--quiet");
  words.insert(words.end(), more_words.begin(), more_words.end());
  process::Process run(words, {"LD_PRELOAD=" STARLOOP_FAULT_SHIM, "STARLOOP_FAULT=" + fault});
  Outcome outcome;
  outcome.exit_code = run.wait();
  const fs::path log = folder.path() / "latest" / "record.slog";
  outcome.has_log = fs::exists(log) && fs::file_size(log) > 0;
  // A log without its first record cannot be loaded, and says so.
  try {
    if (outcome.has_log) outcome.log = hil::load_recording(log.string());
  } catch (const std::exception&) {
    outcome.has_log = false;
  }
  return outcome;
}

std::map<std::uint64_t, std::uint32_t> checksums(const hil::Recording& log) {
  std::map<std::uint64_t, std::uint32_t> sums;
  for (const hil::LogFrame& f : log.frames) sums[f.sequence] = f.pixels_crc32c;
  return sums;
}

/// A prefix of the calm run's: nothing that is in the log is wrong.
void expect_prefix(const hil::Recording& log, const hil::Recording& calm) {
  const auto expected = checksums(calm);
  for (const auto& [sequence, sum] : checksums(log)) {
    ASSERT_TRUE(expected.contains(sequence)) << sequence;
    EXPECT_EQ(sum, expected.at(sequence)) << sequence;
  }
}

class HostileSystem : public testing::Test {
 protected:
  static void SetUpTestSuite() { calm_ = new Outcome(run_with("none")); }
  static void TearDownTestSuite() { delete calm_; }
  static const Outcome& calm() { return *calm_; }

 private:
  static inline Outcome* calm_ = nullptr;
};

TEST_F(HostileSystem, TheCalmRunIsWhole) {
  ASSERT_EQ(calm().exit_code, kGood);
  ASSERT_TRUE(calm().has_log);
  EXPECT_TRUE(calm().log.end.has_value());
  EXPECT_EQ(calm().log.frames.size(), 6U);
}

TEST_F(HostileSystem, NoMemoryAnywhereInStartUpIsAnErrorAndNoCrash) {
  // Some 6000 are made before the first frame; every one of the first 1000 was tried once.
  for (int n = 1; n <= 5500; n += 150) {
    const Outcome run = run_with("new:" + std::to_string(n));
    // The TOML reader takes some for a number that it cannot read.
    EXPECT_TRUE(run.exit_code == kDeviceFault || run.exit_code == kBadInput)
        << "allocation " << n << ": " << run.exit_code;
  }
}

TEST_F(HostileSystem, ADiskThatSaysNoOnceOrForGoodLeavesAPrefixOfTheLog) {
  for (const std::string kind : {"write:", "short:"}) {
    for (int n = 1; n <= 25; n += 4) {
      for (const std::string rest : {":28", "+:28", "+:5"}) {
        const std::string fault = kind + std::to_string(n) + rest;
        const Outcome run = run_with(fault);
        EXPECT_TRUE(run.exit_code == kGood || run.exit_code == kDeviceFault)
            << fault << ": " << run.exit_code;
        if (run.has_log) expect_prefix(run.log, calm().log);
        if (kind == "short:" && rest != ":28") break;  // a short write has no errno
      }
    }
  }
}

TEST_F(HostileSystem, ASyncThatFailsCostsNoFrame) {
  for (const std::string fault : {"sync:1:5", "sync:1+:5", "sync:2:28"}) {
    const Outcome run = run_with(fault, {"--set", "record.sync_s=1e-6"});
    EXPECT_TRUE(run.exit_code == kGood || run.exit_code == kDeviceFault) << fault;
    if (run.has_log) expect_prefix(run.log, calm().log);
  }
}

TEST_F(HostileSystem, AFileThatCannotBeMadeIsSaidOrDoneWithout) {
  for (int n = 1; n <= 8; ++n) {
    for (const std::string error : {":28", ":24"}) {
      const std::string fault = "open:" + std::to_string(n) + error;
      const Outcome run = run_with(fault);
      EXPECT_TRUE(run.exit_code == kGood || run.exit_code == kDeviceFault)
          << fault << ": " << run.exit_code;
    }
  }
}

TEST_F(HostileSystem, AThreadThatCannotBeMadeEndsTheRunWithoutAHang) {
  int failed = 0;
  for (int n = 1; n <= 14; ++n) {
    const Outcome run = run_with("thread:" + std::to_string(n) + ":11", {"--threads", "4"});
    EXPECT_TRUE(run.exit_code == kGood || run.exit_code == kDeviceFault) << n;
    if (run.exit_code == kDeviceFault) ++failed;
  }
  EXPECT_GE(failed, 8);
}

TEST_F(HostileSystem, ASignalAMillisecondChangesNoBit) {
  const Outcome run = run_with("eintr");
  EXPECT_EQ(run.exit_code, kGood);
  ASSERT_TRUE(run.log.end.has_value());
  EXPECT_EQ(checksums(run.log), checksums(calm().log));
}

TEST_F(HostileSystem, ATimeOfDayThatJumpsByHoursIsNotLookedAt) {
  const Outcome run = run_with("clock", {"--set", "run.clock=realtime"});
  EXPECT_EQ(run.exit_code, kGood);
  ASSERT_TRUE(run.log.end.has_value());
  const hil::LoopReport& loop = run.log.end->loop;
  EXPECT_EQ(loop.due, 6U);
  EXPECT_EQ(loop.sent + loop.skipped + loop.dropped, 6U);
  EXPECT_GE(loop.sent, 1U) << "an hour forward would be the end of it at once";
}

/// A run in real time that would take 20 s, ended by a signal once it is on its way.
Outcome ended_by(int signal) {
  const TemporaryFolder folder;
  process::Process run(small_run(folder.path(), {"run.clock=realtime", "run.duration_s=20"}));
  for (std::string line = run.line(); !line.starts_with("frame "); line = run.line())
    if (line.empty()) break;
  run.send(signal);
  Outcome outcome;
  outcome.exit_code = run.wait();
  outcome.log = hil::load_recording((folder.path() / "latest" / "record.slog").string());
  return outcome;
}

TEST(Signals, EndARunInOrderAndItsLogHasAnEnd) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    const Outcome run = ended_by(signal);
    EXPECT_EQ(run.exit_code, kGood) << signal;
    EXPECT_TRUE(run.log.end.has_value()) << signal;
    EXPECT_LT(run.log.frames.size(), 200U) << signal;
    EXPECT_EQ(run.log.fault, "") << signal;
  }
}

TEST(Signals, AReaderOfTheLinesWhoLeavesDoesNotEndARun) {
  const TemporaryFolder folder;
  process::Process run(small_run(folder.path()));
  run.close_pipe();
  EXPECT_EQ(run.wait(), kGood);
  const auto log = hil::load_recording((folder.path() / "latest" / "record.slog").string());
  EXPECT_EQ(log.frames.size(), 6U);
}

TEST(Signals, FortyStartsAndStopsLeaveWholeLogs) {
  for (int i = 0; i < 40; ++i) {
    const TemporaryFolder folder;
    process::Process run(small_run(folder.path(), {"run.clock=realtime", "run.duration_s=20"}));
    // After any of its first lines: in set-up the signal just ends it.
    for (int lines = i % 8; lines > 0; --lines) static_cast<void>(run.line());
    run.send(SIGTERM);
    const int code = run.wait();
    EXPECT_TRUE(code == kGood || code == 128 + SIGTERM) << code;
    const fs::path path = folder.path() / "latest" / "record.slog";
    if (!fs::exists(path)) continue;
    const hil::Recording log = hil::load_recording(path.string());
    EXPECT_EQ(log.fault, "");
    EXPECT_TRUE(log.end.has_value()) << "the signal came once it was set up, and was obeyed";
  }
}

}  // namespace
