// What `starloop stages` writes: one radiance with and without vibration and photon noise.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "engine/core/fits.h"
#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::Outcome;
using program::starloop;

constexpr double kGain_e_dn = 30000.0 / 65536.0;

/// A small camera, so deep that its quantiser does not matter.
Outcome stages(const fs::path& out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {"stages", STARLOOP_SOURCE_DIR "/config/flyby.toml",
                                        "--time", "309785.63",
                                        "--out",  out.string()};
  for (const std::string set :
       {"camera.width_px=192", "camera.height_px=192", "detector.bits=16",
        "detector.quantiser=round", "detector.read_noise_e=50", "detector.prnu_rms=0.1"}) {
    arguments.emplace_back("--set");
    arguments.push_back(set);
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  return starloop(arguments);
}

std::map<char, engine::DnImage> frames_of(const fs::path& folder) {
  std::map<char, engine::DnImage> frames;
  for (const char letter : {'a', 'b', 'c', 'd'})
    frames[letter] = engine::read_fits((folder / (std::string("s_") + letter + ".fits")).string());
  return frames;
}

double electrons_of(const engine::DnImage& frame) {
  double sum = 0;
  for (const std::uint16_t dn : frame.pixels()) sum += dn * kGain_e_dn;
  return sum;
}

/// Whether what makes `noisy` of `mean` is the light's own noise and no other.
void expect_poisson(const engine::DnImage& mean, const engine::DnImage& noisy) {
  double sum = 0;
  double square = 0;
  int count = 0;
  for (std::size_t i = 0; i < mean.pixels().size(); ++i) {
    const double mean_e = mean.pixels()[i] * kGain_e_dn;
    if (mean_e < 400.0) continue;  // bright: what the quantiser adds is 1e-4 of the variance
    const double z = (noisy.pixels()[i] * kGain_e_dn - mean_e) / std::sqrt(mean_e);
    sum += z;
    square += z * z;
    ++count;
  }
  ASSERT_GT(count, 1000);
  EXPECT_NEAR(sum / count, 0.0, 5.0 / std::sqrt(count));
  EXPECT_NEAR(square / count, 1.0, 5.0 * std::sqrt(2.0 / count));
}

TEST(StarloopStages, VibrationMovesLightAndPhotonNoiseIsPoisson) {
  const program::TemporaryFolder folder;
  const Outcome run = stages(folder.path() / "s.png", {"--set", "optics.vibration_urad=3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto frames = frames_of(folder.path());
  // Light goes some two pixels about: what crosses the frame's edges is a thousandth at most.
  const double flux_e = electrons_of(frames.at('a'));
  EXPECT_GT(flux_e, 1e6);
  EXPECT_NEAR(electrons_of(frames.at('b')) / flux_e, 1.0, 1e-3);
  const auto peak = [&](char stage) {
    return *std::ranges::max_element(frames.at(stage).pixels());
  };
  EXPECT_LT(peak('b'), peak('a'));
  expect_poisson(frames.at('a'), frames.at('c'));
  expect_poisson(frames.at('b'), frames.at('d'));
  if (run.out.find("no picture") == std::string::npos) {
    EXPECT_GT(fs::file_size(folder.path() / "s.png"), 10'000U);
  }
}

TEST(StarloopStages, WithoutVibrationItSaysWhichKeyToSet) {
  const program::TemporaryFolder folder;
  const Outcome run = stages(folder.path() / "s.png", {"--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  EXPECT_NE(run.err.find("--set optics.vibration_urad=3"), std::string::npos) << run.err;
  const auto frames = frames_of(folder.path());
  EXPECT_TRUE(std::ranges::equal(frames.at('a').pixels(), frames.at('b').pixels()));
  EXPECT_TRUE(std::ranges::equal(frames.at('c').pixels(), frames.at('d').pixels()));
  const Outcome slow = stages(folder.path() / "s.png", {"--set", "optics.vibration_urad=3", "--set",
                                                        "optics.vibration_hz=100"});
  ASSERT_EQ(slow.exit_code, 0) << slow.err;
  EXPECT_NE(slow.err.find("it is a path, and in all four"), std::string::npos) << slow.err;
}

TEST(StarloopStages, BadInputIsTwo) {
  const std::string flyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";
  EXPECT_EQ(starloop({"stages", flyby}).exit_code, 2);
  EXPECT_EQ(starloop({"stages", flyby, "--time", "-1"}).exit_code, 2);
  const Outcome wrong =
      starloop({"stages", flyby, "--time", "1", "--set", "optics.vibration_urad=-3"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("optics.vibration_urad"), std::string::npos) << wrong.err;
  const Outcome nowhere = stages("/nonexistent/s.png", {});
  EXPECT_EQ(nowhere.exit_code, 3);
  EXPECT_NE(nowhere.err.find("/nonexistent/s_a.fits"), std::string::npos) << nowhere.err;
}

}  // namespace
