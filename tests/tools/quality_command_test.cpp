#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.h"

namespace {

using nlohmann::json;
using program::content_of;
using program::TemporaryFolder;

std::vector<std::string> on_flyby(const std::string& command, const std::string& out,
                                  const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {command, STARLOOP_SOURCE_DIR "/config/flyby.toml", "--out",
                                        out};
  for (const char* value :
       {"camera.width_px=128", "camera.height_px=128", "camera.focal_length_m=1",
        "optics.aperture_m=0.08", "detector.pedestal_dn=20"})
    arguments.insert(arguments.end(), {"--set", value});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(QualityCommand, SaysOfAFitsFileAndItsPngWhatRenderSaid) {
  const TemporaryFolder folder;
  const std::string fits = folder.path() / "frame.fits";
  const std::string png = folder.path() / "frame.png";
  const auto rendered = program::starloop(on_flyby("render", fits, {"--time", "309781.7"}));
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  const auto text = program::starloop({"quality", fits, "--gain", "14.655593551538837"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const std::string line = text.out.substr(fits.size() + 2);
  EXPECT_NE(line.find(" dB "), std::string::npos);
  EXPECT_NE(rendered.out.find("picture: " + line), std::string::npos) << rendered.out << line;

  const auto both = program::starloop({"quality", fits, png, "--json"});
  ASSERT_EQ(both.exit_code, 0) << both.err;
  json list = json::parse(both.out);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1].at("file"), png);
  list[0].erase("file");
  list[1].erase("file");
  EXPECT_EQ(list[0], list[1]);
}

TEST(QualityCommand, NamesWhatItCannotReadAndScoresTheRest) {
  const TemporaryFolder folder;
  const std::string empty = folder.path() / "empty.png";
  const std::string cut = folder.path() / "cut.fits";
  const std::string coloured = STARLOOP_SOURCE_DIR "/docs/pointing_error.png";
  std::ofstream(empty).close();
  std::ofstream(cut) << "SIMPLE  =                    T";
  const auto outcome = program::starloop({"quality", "nowhere.png", empty, cut, coloured,
                                          STARLOOP_SOURCE_DIR "/tests/golden/near.png"});
  EXPECT_EQ(outcome.exit_code, 2);
  for (const std::string& name : {std::string("nowhere.png"), empty, cut, coloured})
    EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("near.png: "), std::string::npos) << outcome.out;
}

TEST(QualityCommand, LaddersLeaveATableAndTheFrames) {
  const TemporaryFolder folder;
  const std::string out = folder.path() / "ladders";
  const auto outcome =
      program::starloop(on_flyby("quality-ladders", out, {"--time", "309781.7", "-q"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream csv(content_of(out + "/ladders.csv"));
  std::string row;
  std::getline(csv, row);
  int rows = 0;
  for (; std::getline(csv, row); ++rows) {
    std::vector<std::string> cells;
    std::istringstream line(row);
    for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 10U) << row;
    EXPECT_TRUE(std::filesystem::exists(out + "/" + cells[8])) << row;
  }
  EXPECT_EQ(rows, 6 + 6 + 7 + 6);
  const auto steep = program::starloop(on_flyby(
      "quality-ladders", out, {"--time", "309781.7", "--set", "optics.zernike_nm.z4=300"}));
  EXPECT_EQ(steep.exit_code, 2);
  EXPECT_NE(steep.err.find("zernike_nm"), std::string::npos) << steep.err;
}

TEST(QualityCommand, ARunScoresItsFramesUnlessToldNotTo) {
  for (const bool scored : {true, false}) {
    const TemporaryFolder folder;
    const auto outcome = program::starloop(on_flyby(
        "run", folder.path(),
        {"--no-pictures", "--set", "run.clock=lockstep", "--set", "run.duration_s=1", "--set",
         std::string("record.quality=") + (scored ? "true" : "false"), "--open-loop"}));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto report = json::parse(content_of(folder.path() / "latest" / "report.json"));
    EXPECT_EQ(std::filesystem::exists(folder.path() / "latest" / "quality.csv"), scored);
    EXPECT_EQ(outcome.out.find("frames have a score") != std::string::npos, scored);
    if (!scored) {
      EXPECT_TRUE(report.at("image_quality").is_null());
      continue;
    }
    EXPECT_EQ(report.at("image_quality").at("frames"), report.at("frames").at("sent"));
    EXPECT_EQ(report.at("image_quality").at("scored"), report.at("frames").at("sent"));
  }
}

}  // namespace
