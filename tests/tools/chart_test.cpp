#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/core/random.h"
#include "tests/support/temporary_folder.h"
#include "tools/chart/chart_scene.h"
#include "tools/chart/knobs.h"
#include "tools/chart/light_error.h"
#include "tools/chart/probe.h"

#include <starloop_test_paths.h>

namespace chart {
namespace {

using engine::IrradianceImage;
using engine::TruthMask;

constexpr int kSide = 64;
constexpr engine::Duration kExposure{1'000'000};

engine::DetectorSpec detector() {
  engine::DetectorSpec spec;
  spec.read_noise_e = 3.0;
  spec.dark_e_s = 0.0;
  return spec;
}

/// A square of light from 24 to 39, columns and rows, moved by whole pixels, in electrons.
IrradianceImage square(double light_e, int right = 0) {
  IrradianceImage image(kSide, kSide);
  for (int v = 24; v < 40; ++v)
    for (int u = 24; u < 40; ++u) image.at(u + right, v) = static_cast<float>(light_e);
  return image;
}

TruthMask mask_of_square() {
  TruthMask mask(kSide);
  for (std::uint16_t v = 24; v < 40; ++v) mask.add({v, 24, 40});
  return mask;
}

LightStack stack_of(const std::vector<IrradianceImage>& images) {
  LightStack stack(kSide, kSide, 30000.0);
  for (const IrradianceImage& image : images) stack.add(image, 1.0);
  return stack;
}

/// The square of 1000 e-, each of its pixels uniform within +-20 e-: of variance 400/3.
std::vector<IrradianceImage> scattered(std::uint32_t frames) {
  std::vector<IrradianceImage> images;
  for (std::uint32_t k = 0; k < frames; ++k) {
    images.push_back(square(1000.0));
    engine::Draws draws(frames, engine::Stream::kCharts, k, 7);
    for (float& e : images.back().pixels())
      if (e > 0.0F) e += 40.0F * (draws.uniform() - 0.5F);
  }
  return images;
}

TEST(LightError, ARightImageIsNotOff) {
  const LightStack reference = stack_of({square(1000.0)});
  const PixelSorter sorter(reference, mask_of_square(), detector(), kExposure);
  const LightError error = sorter.compare(stack_of({square(1000.0)}));
  EXPECT_EQ(error.lit.px, 256);
  EXPECT_EQ(error.edge.px, 60);
  EXPECT_EQ(error.lit.rho, 0.0);
  EXPECT_EQ(error.flux_share, 0.0);
  EXPECT_EQ(error.centroid_px, 0.0);
}

TEST(LightError, ABiasIsToldInSigmasOfTheCamera) {
  const LightStack reference = stack_of({square(1000.0)});
  const engine::DetectorSpec spec = detector();
  const PixelSorter sorter(reference, mask_of_square(), spec, kExposure);
  const LightError error = sorter.compare(stack_of({square(1010.0)}));
  EXPECT_NEAR(error.lit.rho, 10.0 / spec.noise_e(1000.0), 1e-9);
  EXPECT_EQ(error.lit.noise, 0.0);
  EXPECT_EQ(error.sky.rho, 0.0);
  EXPECT_NEAR(error.flux_share, 0.01, 1e-9);
  EXPECT_NEAR(error.centroid_px, 0.0, 1e-9);
}

TEST(LightError, ShiftedLightIsOffByTheShift) {
  const LightStack reference = stack_of({square(1000.0)});
  const PixelSorter sorter(reference, mask_of_square(), detector(), kExposure);
  const LightError error = sorter.compare(stack_of({square(1000.0, 2)}));
  EXPECT_NEAR(error.centroid_px, 2.0, 1e-6);
  EXPECT_NEAR(error.flux_share, 0.0, 1e-9);
}

TEST(LightError, ScatterOfFramesIsNoiseAndNotBias) {
  // The estimate of the bias' square scatters by sqrt(2/256) of variance/12.
  const LightStack reference = stack_of({square(1000.0)});
  const engine::DetectorSpec spec = detector();
  const PixelSorter sorter(reference, mask_of_square(), spec, kExposure);
  const LightError error = sorter.compare(stack_of(scattered(12)));
  const double one = std::sqrt(400.0 / 3.0) / spec.noise_e(1000.0);
  EXPECT_NEAR(error.lit.noise, one, 0.05 * one);
  EXPECT_LT(error.lit.bias, one * std::sqrt(4.0 * std::sqrt(2.0 / 256.0) / 12.0));
}

TEST(LightError, TheReferencesOwnNoiseIsNotHeldAgainstAFrame) {
  const LightStack reference = stack_of(scattered(4));
  const engine::DetectorSpec spec = detector();
  const PixelSorter sorter(reference, mask_of_square(), spec, kExposure);
  const LightError error = sorter.compare(stack_of({square(1000.0)}));
  const double mean_of_four = std::sqrt(400.0 / 3.0 / 4.0) / spec.noise_e(1000.0);
  EXPECT_NEAR(error.lit.reference, mean_of_four, 0.1 * mean_of_four);
  // 4 sigma of what is left when it is taken off; without, rho is mean_of_four.
  EXPECT_LT(error.lit.rho, mean_of_four * std::sqrt(4.0 * std::sqrt(2.0 / 256.0)));
}

TEST(LightError, WhatIsFullIsFull) {
  const LightStack reference = stack_of({square(40000.0)});
  const PixelSorter sorter(reference, mask_of_square(), detector(), kExposure);
  EXPECT_TRUE(reference.clipped(30 * kSide + 30));
  EXPECT_EQ(sorter.compare(stack_of({square(90000.0)})).lit.rho, 0.0);
}

TEST(LightError, ASceneWithoutTargetHasNoFigures) {
  const LightStack reference = stack_of({IrradianceImage(kSide, kSide)});
  const PixelSorter sorter(reference, TruthMask(kSide), detector(), kExposure);
  const LightError error = sorter.compare(stack_of({IrradianceImage(kSide, kSide)}));
  EXPECT_EQ(error.lit.px, 0);
  EXPECT_TRUE(std::isnan(error.lit.rho));
  EXPECT_TRUE(std::isnan(error.flux_share));
  // But all of it is sky, whose stars may be off.
  EXPECT_EQ(error.sky.px, kSide * kSide);
  EXPECT_EQ(error.sky.rho, 0.0);
}

TEST(Knobs, EachRungOfAMixtureIsTakenAsOftenAsAnyOther) {
  const auto settings = mixed_settings(64, 1);
  const auto& knobs = all_knobs();
  for (std::size_t k = 0; k < knobs.size(); ++k) {
    std::map<std::size_t, int> taken;
    for (const Setting& s : settings) ++taken[s.rungs.at(k)];
    ASSERT_EQ(taken.size(), knobs[k].rungs.size()) << knobs[k].name;
    const int least = 64 / static_cast<int>(knobs[k].rungs.size());
    for (const auto& [rung, count] : taken) EXPECT_NEAR(count, least, 1) << knobs[k].name;
  }
}

TEST(Knobs, MixturesAreTheSameForASeedAndOthersForAnother) {
  const auto names = [](const std::vector<Setting>& settings) {
    std::vector<std::vector<std::size_t>> all;
    for (const Setting& s : settings) all.push_back(s.rungs);
    return all;
  };
  EXPECT_EQ(names(mixed_settings(12, 1)), names(mixed_settings(12, 1)));
  EXPECT_NE(names(mixed_settings(12, 1)), names(mixed_settings(12, 2)));
}

TEST(Knobs, EveryRungIsOneThatAScenarioKnows) {
  const ChartScene scene = read_chart_scene(STARLOOP_SOURCE_DIR "/config/scenes/pass_70km.toml");
  for (const Setting& setting : single_settings())
    EXPECT_NO_THROW(static_cast<void>(scene.with(setting.sets))) << setting.name;
  EXPECT_NO_THROW(static_cast<void>(scene.with(reference_setting(64).sets)));
}

TEST(ChartScene, TheProjectsOwnAreRead) {
  const auto scenes = read_chart_scenes(STARLOOP_SOURCE_DIR "/config/scenes");
  EXPECT_GE(scenes.size(), 10U);
  std::set<std::string> titles;
  for (const ChartScene& scene : scenes) titles.insert(scene.title);
  EXPECT_EQ(titles.size(), scenes.size());
}

std::string complaint_about(const std::string& text) {
  const test_support::TemporaryFolder folder;
  const std::string path = folder.path() / "scene.toml";
  std::ofstream(path) << text;
  try {
    static_cast<void>(read_chart_scene(path));
  } catch (const engine::ConfigError& e) {
    return std::string(e.what()).substr(path.size());
  }
  return "read";
}

TEST(ChartScene, WhatIsWrongIsToldWithItsPlace) {
  const std::string flyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";
  const std::string head = "[scene]\ntitle = \"x\"\nscenario = \"" + flyby + "\"\n";
  EXPECT_EQ(complaint_about(head + "time_s = 1.0\n"), "read");
  EXPECT_EQ(complaint_about(head), ": scene.time_s is missing, expected >= 0 and <= 9000000000");
  EXPECT_EQ(complaint_about(head + "time_s = 1.0\ntime = 2\n"),
            ":5: scene.time is not a key of a scene");
  EXPECT_EQ(complaint_about(head + "time_s = 1.0\nset = [\"render.lattice=9x9\"]\n"),
            ": --set render.lattice=9x9: render.lattice must be one of \"auto\", \"8x8\", \"4x4\", "
            "\"2x2\", got \"9x9\"");
}

TEST(Probe, TheSameSettingShowsTheSameLight) {
  ChartScene scene = read_chart_scene(STARLOOP_SOURCE_DIR "/config/scenes/pass_300km.toml");
  const std::vector<std::string> small = {"camera.width_px=96", "camera.height_px=96",
                                          "render.method=paths"};
  const ProbeSpec spec{.before = 0, .timed = 2, .repeated = 2, .threads = 1};
  const Probe once = try_setting(scene, small, spec);
  const Probe again = try_setting(scene, small, spec);
  ASSERT_EQ(once.light.frames(), 2);
  EXPECT_EQ(once.cpu_ms.size(), 2U);
  bool scatters = false;
  for (std::size_t i = 0; i < 96 * 96; ++i) {
    ASSERT_EQ(once.light.mean_e(i), again.light.mean_e(i));
    scatters = scatters || once.light.variance_e2(i) > 0.0;
  }
  EXPECT_TRUE(scatters);  // repeats have random numbers of their own
  EXPECT_NE(once.rungs.find("method paths"), std::string::npos) << once.rungs;
}

TEST(Probe, QuantilesAreValuesThatThereAre) {
  EXPECT_EQ(quantile({3.0, 1.0, 2.0}, 0.5), 2.0);
  EXPECT_EQ(quantile({3.0, 1.0, 2.0}, 0.99), 3.0);
  EXPECT_EQ(quantile({3.0}, 0.0), 3.0);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

}  // namespace
}  // namespace chart
