// The presets whose fields have stars: what the program shows is the sky.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "engine/core/constants.h"
#include "engine/scene/star_zones.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/scenario.h"

namespace {

using engine::kDegree;

starloop::Scenario preset(const std::string& name, const std::vector<std::string>& overrides = {}) {
  starloop::CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/" + name;
  options.overrides = overrides;
  return starloop::load_scenario(options);
}

struct Taken {
  engine::DnImage image;
  engine::FrameReport report;
  engine::CameraAttitude attitude;
};

Taken take(const starloop::Scenario& scenario, int threads = 1) {
  starloop::Rig rig(scenario, threads);
  hil::ScriptedPointing pointing = rig.prediction();
  engine::Shot shot;
  shot.shutter_open = engine::sim_time(309770.0);
  shot.exposure = scenario.run.exposure;
  Taken taken;
  taken.attitude = pointing.attitude(shot.shutter_open);
  shot.attitude = {taken.attitude, taken.attitude, taken.attitude};
  engine::TruthMask mask;
  taken.report = rig.generator().expose(shot, engine::Budget{}, taken.image, mask);
  return taken;
}

/// Of what stands out within 8 px of a place.
engine::PixelPoint light_near(const engine::DnImage& image, const engine::PixelPoint& p) {
  double sum = 0;
  engine::PixelPoint at;
  for (int v = static_cast<int>(p.v) - 8; v <= static_cast<int>(p.v) + 8; ++v) {
    for (int u = static_cast<int>(p.u) - 8; u <= static_cast<int>(p.u) + 8; ++u) {
      const double light = std::max(image.at(u, v) - 60.0, 0.0);
      sum += light;
      at.u += light * u;
      at.v += light * v;
    }
  }
  return {at.u / sum, at.v / sum};
}

TEST(StarPresets, ThePleiadesStandAsTheyStandInTheSky) {
  // Alcyone, Atlas, Electra, Maia, Taygeta, Merope: Hipparcos at J2000. They move together.
  constexpr std::array<std::array<double, 2>, 6> kPleiades_deg{{{56.87115, 24.10514},
                                                                {57.29059, 24.05342},
                                                                {56.21890, 24.11334},
                                                                {56.45669, 24.36775},
                                                                {56.30206, 24.46728},
                                                                {56.58155, 23.94836}}};
  const starloop::Scenario scenario = preset("star_field_1_5deg.toml");
  const Taken taken = take(scenario);
  std::array<engine::PixelPoint, 6> seen;
  std::array<engine::PixelPoint, 6> expected;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto unit = engine::unit_at(kPleiades_deg[i][0] * kDegree, kPleiades_deg[i][1] * kDegree);
    expected[i] = scenario.scene.camera.project(taken.attitude.axes.matrix * unit).value();
    seen[i] = light_near(taken.image, expected[i]);
    // Aberration by 30 + 8 km/s is 26" or 4.9 px at most, proper motion 1" or .2 px.
    EXPECT_LT(std::hypot(seen[i].u - expected[i].u, seen[i].v - expected[i].v), 5.2) << i;
  }
  for (std::size_t i = 1; i < seen.size(); ++i) {
    // Aberration stretches 600 px by 1e-4, the source is rounded to .1 px, a window's centroid with
    // noise and threshold is good to .1 px.
    EXPECT_NEAR(seen[i].u - seen[0].u, expected[i].u - expected[0].u, 0.25) << i;
    EXPECT_NEAR(seen[i].v - seen[0].v, expected[i].v - expected[0].v, 0.25) << i;
  }
  EXPECT_NEAR(taken.report.stars.brightest_v, 2.85, 0.005);  // Alcyone
  EXPECT_NEAR(taken.report.stars.brightest_px.u, seen[0].u, 0.1);
}

TEST(StarPresets, NorthIsUpAndEastToTheLeft) {
  const starloop::Scenario scenario = preset(
      "star_field_20deg.toml", {"guidance.boresight_ra_deg=30", "guidance.boresight_dec_deg=40"});
  const auto axes = scenario.boresight.value().axes.matrix;
  EXPECT_NEAR(axes.determinant(), 1.0, 1e-12);
  const auto& camera = scenario.scene.camera;
  const auto at = [&](double ra_deg, double dec_deg) {
    return camera.project(axes * engine::unit_at(ra_deg * kDegree, dec_deg * kDegree)).value();
  };
  EXPECT_NEAR(at(30.0, 40.0).u, camera.principal_point().u, 1e-9);
  EXPECT_LT(at(31.0, 40.0).u, camera.principal_point().u);
  EXPECT_LT(at(30.0, 41.0).v, camera.principal_point().v);
  EXPECT_NEAR(at(30.0, 41.0).u, camera.principal_point().u, 1e-6);
}

TEST(StarPresets, AFieldOfTwentyDegreesHasThousandsOfStarsOnAnyNumberOfThreads) {
  const starloop::Scenario scenario = preset("star_field_20deg.toml");
  const Taken one = take(scenario);
  // 22 a square degree to V = 11, somewhat more in Orion.
  EXPECT_GT(one.report.stars.in_frame, 400 * 20);
  const engine::StarReport& stars = one.report.stars;
  EXPECT_EQ(stars.near, stars.drawn + stars.faint + stars.behind_earth + stars.no_room);
  EXPECT_EQ(stars.no_room, 0);
  EXPECT_TRUE(std::ranges::equal(one.image.pixels(), take(scenario, 2).image.pixels()));
}

TEST(StarPresets, StarsDoNotTouchTheTruthAboutTheTarget) {
  const std::vector<std::string> dark{"stars.catalogue=none"};
  const Taken with = take(preset("star_field_1_5deg.toml"));
  const Taken without = take(preset("star_field_1_5deg.toml", dark));
  EXPECT_EQ(with.report.truth.peak_e, without.report.truth.peak_e);
  EXPECT_EQ(with.report.truth.mask_px, without.report.truth.mask_px);
  EXPECT_GT(with.report.peak_dn, without.report.peak_dn + 1000);
  EXPECT_EQ(without.report.stars.near, 0);
}

TEST(StarPresets, AWrongSkyIsRefused) {
  for (const std::string wrong :
       {"stars.catalogue=/no/such.csv", "stars.catalogue=\"\"", "stars.limit_magnitude=nan",
        "stars.colour=1", "guidance.boresight_dec_deg=91"}) {
    EXPECT_THROW(starloop::Rig(preset("star_field_20deg.toml", {wrong}), 1), engine::ConfigError)
        << wrong;
  }
}

}  // namespace
