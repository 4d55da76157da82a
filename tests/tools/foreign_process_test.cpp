// Software under test in a process of its own, in another language, as a user's CI would run it.

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"
#include "tests/tools/program.h"

namespace {

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

program::Outcome run_over_shared_memory(const std::filesystem::path& out, const std::string& name,
                                        const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"run", kFlyby, "--quiet", "--out", out.string()};
  for (const std::string& set : {std::string("run.clock=lockstep"), std::string("run.duration_s=8"),
                                 std::string("render.samples_per_pixel=9"), "link.to=shm:" + name,
                                 std::string("link.telemetry_row=true")}) {
    arguments.emplace_back("--set");
    arguments.push_back(set);
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  return program::starloop(arguments);
}

TEST(ForeignProcess, ATrackerInCHoldsTheTargetAndMeetsTheCriteria) {
  const program::TemporaryFolder folder;
  const std::string name = "starloop-test-run-" + std::to_string(getpid());
  process::Process tracker({STARLOOP_EXAMPLE_C, name});
  const program::Outcome run = run_over_shared_memory(
      folder.path(), name,
      {"--set", "criteria.min_detection_rate=0.99", "--set", "criteria.max_latency_frames=1"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // The camera is gone, and the example ends.
  EXPECT_EQ(tracker.wait(), 0);
  const auto report =
      nlohmann::json::parse(program::content_of(folder.path() / "latest" / "report.json"));
  EXPECT_EQ(report["frames"]["sent"], 81);
  EXPECT_EQ(report["commands"]["taken"], 81);
  EXPECT_EQ(report["commands"]["refused"], 0);
}

TEST(ForeignProcess, ATrackerThatGotWorseTurnsTheJobRed) {
  const program::TemporaryFolder folder;
  const std::string name = "starloop-test-worse-" + std::to_string(getpid());
  // It takes a pixel for a fifth of what it is, and asks for too little.
  process::Process tracker({STARLOOP_EXAMPLE_C, name, "2.9e-7"});
  const program::Outcome run = run_over_shared_memory(folder.path(), name, {});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE((run.out + run.err).find("must be at most 0.5"), std::string::npos);
}

TEST(ForeignProcess, NobodyThereEndsTheWaitWithAMessageAndCodeThree) {
  const program::TemporaryFolder folder;
  const program::Outcome run =
      run_over_shared_memory(folder.path(), "starloop-test-nobody-" + std::to_string(getpid()),
                             {"--set", "run.start_timeout_s=0.2"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE((run.out + run.err).find("nobody reads the frames after 0.2 s"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "a run that never was left a folder";
}

}  // namespace
