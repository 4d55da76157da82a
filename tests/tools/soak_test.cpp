// starloop soak as its user meets it; in lockstep, so that nothing depends on the machine's speed.

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>
#include <nlohmann/json.hpp>

#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;

program::Outcome short_soak(const fs::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"soak",  STARLOOP_SOURCE_DIR "/config/flyby.toml",
                                        "--out", out.string(),
                                        "--set", "run.clock=lockstep",
                                        "--set", "render.samples_per_pixel=2",
                                        "--set", "run.duration_s=1"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return program::starloop(arguments);
}

TEST(StarloopSoak, FliesRoundsKeepsTheLastOneAndFindsNothing) {
  const program::TemporaryFolder folder;
  // Six seconds: rounds take one or two.
  const program::Outcome soak = short_soak(folder.path(), {"--minutes", "0.1"});
  EXPECT_EQ(soak.exit_code, 0) << soak.out << soak.err;
  const fs::path kept = folder.path() / "latest";
  const auto json = nlohmann::json::parse(program::content_of(kept / "soak.json"));
  const std::size_t rounds = json["rounds"].size();
  ASSERT_GE(rounds, 1U);
  for (const auto& round : json["rounds"]) {
    EXPECT_EQ(round["sent"], 11);
    EXPECT_EQ(round["read"], 11);
    EXPECT_EQ(round["logged"], 11);
  }
  EXPECT_EQ(json["checks"].back()["name"], "replay");
  for (std::size_t i = 1; i <= rounds; ++i)
    EXPECT_EQ(fs::exists(kept / ("round-" + std::to_string(i))), i == rounds) << i;
}

TEST(StarloopSoak, FaultsOnPurposeAreNothingToSoak) {
  const program::TemporaryFolder folder;
  const program::Outcome soak =
      short_soak(folder.path(), {"--minutes", "0.01", "--set", "faults.dropped.probability=0.1"});
  EXPECT_EQ(soak.exit_code, 2);
  EXPECT_NE(soak.err.find("faults.dropped"), std::string::npos) << soak.err;
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
