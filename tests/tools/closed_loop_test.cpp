// The number that the whole program is judged by: how well the loop holds the target.

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.h"

namespace {

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

TEST(ClosedLoop, HoldsTheTargetToHalfAPixelThroughThePapersPass) {
  const program::TemporaryFolder folder;
  const program::Outcome run = program::starloop(
      {"run", kFlyby, "--set", "run.clock=lockstep", "--quiet", "--out", folder.path().string()});
  const auto report =
      nlohmann::json::parse(program::content_of(folder.path() / "latest" / "report.json"));
  // The pass lasts 40.15 s at ten frames a second, and lockstep keeps them all.
  const nlohmann::json& frames = report.at("frames");
  EXPECT_EQ(frames.at("due"), 402);
  EXPECT_EQ(frames.at("sent"), 402);
  EXPECT_EQ(report.at("commands").at("taken"), 402);
  EXPECT_EQ(report.at("commands").at("lost"), 0);
  EXPECT_EQ(report.at("answer_missing"), false);

  const nlohmann::json& pointing = report.at("pointing");
  EXPECT_EQ(pointing.at("after_s"), 5.0);
  EXPECT_EQ(pointing.at("frames"), 352);
  EXPECT_EQ(pointing.at("frames_without_target"), 0);
  EXPECT_TRUE(pointing.at("lost_after_s").is_null());
  EXPECT_LE(pointing.at("rms_px").get<double>(), 0.5)
      << "worst: " << pointing.at("worst_px") << " px";
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

}  // namespace
