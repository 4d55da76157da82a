// The whole chain from orbits to DN, with one thing turned up at a time: the score falls.

#include <cctype>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "tools/starloop/quality_ladders.h"

namespace {

using Overrides = std::vector<std::string>;
using quality::Verdict;
using starloop::QualityLadder;

/// The paper's telescope at its closest, and how it is looked at.
struct Sight {
  const char* name;
  Overrides overrides;
  std::vector<std::size_t> scored;  ///< steps at least, of each ladder
};
void PrintTo(const Sight& sight, std::ostream* out) { *out << sight.name; }

class QualityLadders : public testing::TestWithParam<Sight> {};

TEST_P(QualityLadders, FallFromStepToStepUntilNothingIsLeftToMeasure) {
  starloop::CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/flyby.toml";
  options.overrides = {"camera.width_px=160", "camera.height_px=160", "detector.pedestal_dn=20",
                       "optics.largest_wing_px=32"};
  options.threads = 1;
  options.overrides.insert(options.overrides.end(), GetParam().overrides.begin(),
                           GetParam().overrides.end());
  const auto ladders = starloop::quality_ladders(options, 309781.7);
  ASSERT_EQ(ladders.size(), GetParam().scored.size());
  for (std::size_t i = 0; i < ladders.size(); ++i) {
    SCOPED_TRACE(ladders[i].name);
    double last_db = 1e9;
    std::size_t scored = 0;
    for (const QualityLadder::Step& step : ladders[i].steps) {
      const double score_db = step.quality.score_db.value_or(-1e9);
      if (step.quality.score_db) {
        ++scored;
        EXPECT_LT(score_db, last_db) << step.value;
      }
      // What is lost to blur or noise does not come back with more of it.
      EXPECT_TRUE(last_db > -1e9 || !step.quality.score_db) << step.value;
      last_db = score_db;
    }
    EXPECT_GE(scored, GetParam().scored[i]) << ladders[i].steps.size();
  }
}

INSTANTIATE_TEST_SUITE_P(
    ImageQuality, QualityLadders,
    testing::Values(
        Sight{"sub_pixel", {"camera.focal_length_m=0.03", "optics.aperture_m=0.006"}, {5, 5, 5, 5}},
        Sight{
            "ten_pixels", {"camera.focal_length_m=0.45", "optics.aperture_m=0.036"}, {6, 6, 5, 5}},
        Sight{"a_hundred_pixels", {}, {6, 6, 6, 6}},
        Sight{"before_the_earth",
              {"camera.focal_length_m=0.45", "optics.aperture_m=0.036", "earth.in_frame=auto"},
              {6, 5, 5, 5}}),
    [](const auto& sight) { return std::string(sight.param.name); });

}  // namespace
