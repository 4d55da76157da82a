// The pictures of tests/golden, rendered again: what no law names is still seen to change.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <opencv2/imgcodecs.hpp>

#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;

const fs::path kGolden = STARLOOP_SOURCE_DIR "/tests/golden";

struct Picture {
  std::string name;
  std::string scenario = "config/flyby.toml";
  std::vector<std::string> arguments;
};

std::vector<Picture> pictures() {
  std::vector<Picture> all;
  std::ifstream file(kGolden / "commands.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Picture picture;
    words >> picture.name;
    for (std::string word; words >> word;) {
      if (word.ends_with(".toml")) {
        picture.scenario = word;
      } else {
        picture.arguments.push_back(word);
      }
    }
    all.push_back(picture);
  }
  return all;
}

TEST(Golden, EveryPictureIsRenderedAgain) {
  ASSERT_EQ(pictures().size(), 5u);
  for (const Picture& picture : pictures()) {
    SCOPED_TRACE(picture.name);
    const program::TemporaryFolder folder;
    std::vector<std::string> call = {"render",
                                     (fs::path(STARLOOP_SOURCE_DIR) / picture.scenario).string(),
                                     "--quiet", "--out", (folder.path() / "frame.fits").string()};
    call.insert(call.end(), picture.arguments.begin(), picture.arguments.end());
    const program::Outcome run = program::starloop(call);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const cv::Mat made = cv::imread(folder.path() / "frame.png", cv::IMREAD_UNCHANGED);
    const cv::Mat golden = cv::imread(kGolden / picture.name, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(golden.type(), CV_16UC1);
    ASSERT_EQ(made.size(), golden.size());
    // Bits are equal on one class of processor. On another, a ray that grazes an edge may fall on
    // its other side: a few pixels, where a change of a model moves every lit one.
    int differ = 0;
    int lit = 0;
    for (int v = 0; v < golden.rows; ++v)
      for (int u = 0; u < golden.cols; ++u) {
        lit += golden.at<std::uint16_t>(v, u) > 0 ? 1 : 0;
        differ += golden.at<std::uint16_t>(v, u) != made.at<std::uint16_t>(v, u) ? 1 : 0;
      }
    EXPECT_GT(lit, 100);
    EXPECT_LE(differ, lit / 100);
    if (differ > lit / 100)
      fs::copy_file(folder.path() / "frame.png", "golden_" + picture.name,
                    fs::copy_options::overwrite_existing);
  }
}

}  // namespace
