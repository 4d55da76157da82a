// `starloop chart` and `starloop budget` from outside.
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/tools/program.h"

#include <starloop_test_paths.h>

namespace {

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

TEST(StarloopChart, WritesARowForEachSettingAndThePage) {
  const program::TemporaryFolder folder;
  const std::string scene = folder.path() / "small.toml";
  std::ofstream(scene) << "[scene]\ntitle = \"small\"\nscenario = \"" << kFlyby
                       << "\"\ntime_s = 309801.7\n"
                          "set = [\"camera.width_px=96\", \"camera.height_px=96\"]\n";
  const std::string out = folder.path() / "chart";
  const auto run = program::starloop({"chart", scene, "--no-sweep", "--try", "render.bounces=0",
                                      "--try", "render.lattice=9x9", "--out", out});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // What is no setting of this scene is said, and is no row.
  EXPECT_NE(run.out.find("render.lattice must be one of"), std::string::npos) << run.out;
  std::istringstream csv(program::content_of(out + "/chart.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(csv, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].find("scene,title,corner,period_ms,kind,setting"), 0U);
  EXPECT_EQ(lines[1].find("small,\"small\",0,100,standard,\"standard\""), 0U) << lines[1];
  EXPECT_EQ(lines[2].find("small,\"small\",0,100,own,\"render.bounces=0\""), 0U) << lines[2];
  EXPECT_TRUE(std::filesystem::exists(out + "/fronts.svg"));
  EXPECT_TRUE(std::filesystem::exists(out + "/chart.html"));
}

TEST(StarloopBudget, SaysWhatLimitsAFrameAndHowFarOffItIs) {
  const std::vector<std::string> common = {"budget", kFlyby,
                                           "--time", "309801.7",
                                           "--set",  "camera.width_px=96",
                                           "--set",  "camera.height_px=96"};
  const auto text = program::starloop(common);
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find("limits the frame rate"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("method lattice"), std::string::npos) << text.out;
  auto as_json = common;
  as_json.insert(as_json.end(), {"--json", "--no-errors"});
  const auto json = program::starloop(as_json);
  ASSERT_EQ(json.exit_code, 0) << json.err;
  EXPECT_NE(json.out.find("\"error\": null"), std::string::npos) << json.out;
  EXPECT_EQ(program::starloop({"budget", "no_such.toml"}).exit_code, 2);
}

}  // namespace
