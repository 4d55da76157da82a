#include "hil/score.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

using engine::ConfigError;
using engine::ConfigReader;
using engine::PixelPoint;
using engine::PixelRect;
using hil::Command;
using hil::CommandRecord;
using hil::Detection;
using hil::DetectionCriteria;
using hil::DetectionRules;
using hil::DetectionScore;
using hil::FrameRecord;

constexpr PixelPoint kBoresight{32, 32};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A run of ten frames a second, a target of 10 x 6 pixels round the place it is given.
struct Flight {
  std::vector<FrameRecord> frames;
  std::vector<CommandRecord> commands;
  DetectionRules rules;

  engine::FrameTruth& frame(PixelPoint at = kBoresight) {
    FrameRecord r;
    r.sequence = frames.size();
    r.shutter_open = engine::sim_time(0.1 * static_cast<double>(frames.size()));
    r.handed_over = true;
    r.report.truth.photocentre_px = at;
    const int u = static_cast<int>(at.u);
    const int v = static_cast<int>(at.v);
    r.report.truth.box = {u - 5, v - 3, u + 5, v + 3};
    r.report.truth.mask_px = 60;
    r.report.truth.visible_fraction = 1.0;
    r.report.truth.signal_to_noise = 50.0;
    frames.push_back(r);
    return frames.back().report.truth;
  }
  /// An answer that shows in the frame after, or `latency` after.
  Command& answer(std::uint64_t to, PixelPoint at, std::uint64_t latency = 1,
                  std::uint32_t id = 1) {
    Command c;
    c.answers_frame = to;
    c.detection = {.centroid_px = at, .confidence = 0.5F, .id = id, .box_px = {}};
    commands.push_back({to + latency, c});
    return commands.back().command;
  }
  [[nodiscard]] DetectionScore score() const {
    const DetectionScore s = hil::score_detections(frames, commands, rules, kBoresight);
    EXPECT_EQ(s.detections, s.matches + s.false_alarms + s.duplicates + s.strays);
    EXPECT_EQ(s.frames, s.answered + s.unanswered);
    EXPECT_EQ(s.frames, s.verdicts.size());
    return s;
  }
};

std::vector<std::string> not_met(const DetectionCriteria& criteria, const DetectionScore& score) {
  return hil::criteria_not_met(hil::judge_detections(criteria, score));
}

TEST(Score, OfNothingIsNothingAndNoNumberIsMadeUp) {
  const DetectionScore s = Flight().score();
  EXPECT_EQ(s.frames, 0U);
  EXPECT_FALSE(s.detection_rate);
  EXPECT_FALSE(s.false_alarms_per_frame);
  EXPECT_FALSE(s.acquisition_s);
  EXPECT_FALSE(s.time_on_target);
  EXPECT_EQ(s.centroid_error_px.count, 0U);
  EXPECT_EQ(s.latency_frames.count, 0U);
}

TEST(Score, WhoeverSaysNothingDetectsNothing) {
  Flight run;
  for (int i = 0; i < 4; ++i) run.frame();
  const DetectionScore s = run.score();
  EXPECT_EQ(s.detectable, 4U);
  EXPECT_EQ(s.unanswered, 4U);
  EXPECT_EQ(s.detection_rate, 0.0);
  EXPECT_EQ(s.false_alarms_per_frame, 0.0);
  EXPECT_FALSE(s.acquisition_s);
  EXPECT_EQ(s.time_on_target, 1.0);
}

TEST(Score, CentroidErrorIsThatAgainstThePhotocentre) {
  Flight run;
  // 3-4-5 triangles: errors of 5, 0, 5 px; 5 below the margin of a box 10 wide.
  for (int i = 0; i < 3; ++i) run.frame();
  run.answer(0, {kBoresight.u + 3, kBoresight.v + 4});
  run.answer(1, kBoresight);
  run.answer(2, {kBoresight.u + 3, kBoresight.v - 4});
  const DetectionScore s = run.score();
  EXPECT_EQ(s.detection_rate, 1.0);
  EXPECT_DOUBLE_EQ(s.centroid_rms_px, std::sqrt(50.0 / 3.0));
  EXPECT_DOUBLE_EQ(s.centroid_bias_px.u, 2.0);
  EXPECT_DOUBLE_EQ(s.centroid_bias_px.v, 0.0);
  EXPECT_EQ(s.centroid_error_px.p50, 5.0);
  EXPECT_EQ(s.centroid_p95_px, 5.0);
  EXPECT_EQ(s.centroid_error_px.max, 5.0);
  EXPECT_EQ(s.verdicts[2].error_px.v, -4.0);
}

TEST(Score, AMatchLiesInTheBoxGrownByTheMarginAndElseItIsAFalseAlarm) {
  // The box's pixels 27 .. 36 reach from 26.5 to 36.5; three more are the margin.
  struct Case {
    double u, v;
    bool found;
  };
  for (const Case& c : {Case{39.4, 32, true},
                        {39.6, 32, false},
                        {23.6, 32, true},
                        {23.4, 32, false},
                        {32, 37.4, true},
                        {32, 37.6, false},
                        {kNan, 32, false}}) {
    SCOPED_TRACE(c.u);
    Flight run;
    run.frame();
    run.answer(0, {c.u, c.v});
    const DetectionScore s = run.score();
    EXPECT_EQ(s.detection_rate, c.found ? 1.0 : 0.0);
    EXPECT_EQ(s.false_alarms, c.found ? 0U : 1U);
  }
}

TEST(Score, ABoxThatOverlapsEnoughIsAMatchToo) {
  // Truth: 26.5 .. 36.5 by 28.5 .. 34.5, 60 px^2. Shifted down by 2: 40 common, 80 in all.
  Flight run;
  run.rules.margin_px = 0;
  for (int i = 0; i < 2; ++i) run.frame();
  run.answer(0, {0, 0}).detection.box_px = {26.5F, 30.5F, 36.5F, 36.5F};
  run.answer(1, {0, 0}).detection.box_px = {26.5F, 30.6F, 36.5F, 36.6F};
  const DetectionScore s = run.score();
  EXPECT_TRUE(s.verdicts[0].found);
  EXPECT_FALSE(s.verdicts[1].found);
  EXPECT_EQ(s.boxes, 1U);
  EXPECT_DOUBLE_EQ(s.box_iou_mean, 0.5);
}

TEST(Score, OnlyOneOfSeveralIsTheTarget) {
  Flight run;
  run.frame();
  run.answer(0, {36, 32}, 1, 1).more_follow = true;
  run.answer(0, {33, 32}, 1, 2).more_follow = true;  // nearer: this is the match
  run.answer(0, {5, 5}, 1, 3);
  const DetectionScore s = run.score();
  EXPECT_EQ(s.matches, 1U);
  EXPECT_EQ(s.false_alarms, 2U);
  EXPECT_EQ(s.false_alarms_per_frame, 2.0);
  EXPECT_EQ(s.centroid_error_px.max, 1.0);
}

TEST(Score, WhatIsSaidTwiceCountsOnce) {
  Flight run;
  run.frame();
  run.answer(0, {33, 32}, 1, 7);
  run.answer(0, {33, 32}, 2, 7);
  run.answer(0, {32, 32}, 3, 7);  // better, but too late
  const DetectionScore s = run.score();
  EXPECT_EQ(s.detections, 3U);
  EXPECT_EQ(s.matches, 1U);
  EXPECT_EQ(s.duplicates, 2U);
  EXPECT_EQ(s.false_alarms, 0U);
  EXPECT_EQ(s.centroid_error_px.max, 1.0);
}

TEST(Score, AnswersToFramesThatWereNeverShownAreStrays) {
  Flight run;
  for (int i = 0; i < 3; ++i) run.frame();
  run.frames[1].handed_over = false;
  run.answer(1, kBoresight);
  run.answer(77, kBoresight);
  run.answer(std::numeric_limits<std::uint64_t>::max() - 1, kBoresight);
  run.answer(2, kBoresight, 0);  // before the frame was over
  const DetectionScore s = run.score();
  EXPECT_EQ(s.frames, 2U);
  EXPECT_EQ(s.strays, 4U);
  EXPECT_EQ(s.unanswered, 2U);
  EXPECT_EQ(s.latency_frames.count, 0U);
}

TEST(Score, FramesInWhichNobodyCouldSeeTheTargetCountNeitherForNorAgainst) {
  Flight run;
  run.frame().visible_fraction = 0.49;
  run.frame().signal_to_noise = 9.9;
  engine::FrameTruth& empty = run.frame();  // an empty sky
  empty = {};
  run.frame();
  run.answer(0, kBoresight);
  run.answer(2, kBoresight);  // sees what is not there
  run.answer(3, kBoresight);
  const DetectionScore s = run.score();
  EXPECT_EQ(s.detectable, 1U);
  EXPECT_EQ(s.detection_rate, 1.0);
  EXPECT_EQ(s.matches, 2U);
  EXPECT_EQ(s.false_alarms, 1U);
  // Where nothing falls on the detector, nothing is on target.
  EXPECT_EQ(s.time_on_target, 0.75);
}

TEST(Score, LatencyIsFromAFrameToTheFirstThatCanShowTheAnswer) {
  Flight run;
  for (int i = 0; i < 3; ++i) run.frame();
  run.answer(0, kBoresight, 1);
  run.answer(1, kBoresight, 4);
  Command silent;  // no detection, an answer all the same
  silent.answers_frame = 2;
  run.commands.push_back({4, silent});
  run.commands.push_back({4, Command{}});  // answers nothing
  const DetectionScore s = run.score();
  EXPECT_EQ(s.answered, 3U);
  EXPECT_EQ(s.latency_frames.count, 3U);
  EXPECT_EQ(s.latency_frames.p50, 2.0);
  EXPECT_EQ(s.latency_frames.max, 4.0);
  EXPECT_EQ(s.verdicts[1].latency_frames, 4U);
}

TEST(Score, AcquisitionIsFromTheFirstFrameThatShowsTheTargetToTheFirstThatIsDetected) {
  Flight run;
  for (int i = 0; i < 10; ++i) run.frame().signal_to_noise = i < 3 ? 0.0 : 50.0;
  for (std::uint64_t i : {1U, 7U, 8U}) run.answer(i, kBoresight);
  const DetectionScore s = run.score();
  ASSERT_TRUE(s.acquisition_s);
  EXPECT_NEAR(*s.acquisition_s, 0.4, 1e-9);  // frames 3 to 7
  EXPECT_NEAR(*s.detection_rate, 2.0 / 7.0, 1e-12);
}

TEST(Score, TimeOnTargetIsTheShareOfFramesWithThePhotocentreNearTheBoresight) {
  Flight run;
  run.frame({36, 35});  // 5 px off
  run.frame({36, 36});  // more
  run.frame(kBoresight);
  run.frame({0, 0});
  EXPECT_EQ(run.score().time_on_target, 0.5);
}

TEST(Score, EachCriterionThatIsMissedIsSaidWithFigureAndLimit) {
  Flight run;
  for (int i = 0; i < 4; ++i) run.frame({40, 40});
  for (std::uint64_t i = 1; i < 4; ++i) run.answer(i, {40, 42}, 3);
  run.answer(3, {1, 1}, 3, 2);
  const DetectionScore s = run.score();
  DetectionCriteria c;
  EXPECT_TRUE(not_met(c, s).empty());
  c.min_detection_rate = 0.75;
  c.max_false_alarms_per_frame = 0.25;
  c.max_centroid_rms_px = 2.0;
  c.max_latency_frames = 3.0;
  c.max_acquisition_s = 0.1;
  c.min_time_on_target = 0.0;
  EXPECT_TRUE(not_met(c, s).empty()) << "just met is met";
  c.min_detection_rate = 0.76;
  c.max_false_alarms_per_frame = 0.0;
  c.max_centroid_rms_px = 1.9;
  c.max_latency_frames = 2.0;
  c.max_acquisition_s = 0.05;
  c.min_time_on_target = 0.5;
  const std::vector<std::string> said = not_met(c, s);
  ASSERT_EQ(said.size(), 6U);
  EXPECT_EQ(said[0], "the detection rate is 0.75, and must be at least 0.76");
  EXPECT_EQ(said[1], "the number of false alarms per frame is 0.25, and must be at most 0");
  EXPECT_EQ(said[2], "the centroid's error in px, rms, is 2, and must be at most 1.9");
  EXPECT_EQ(said[3], "the largest latency in frames is 3, and must be at most 2");
  EXPECT_EQ(said[4], "the time to acquisition in s is 0.1, and must be at most 0.05");
  EXPECT_EQ(said[5], "the share of time on target is 0, and must be at least 0.5");
}

TEST(Score, WhatCouldNotBeMeasuredWasNotMet) {
  DetectionCriteria c;
  c.min_detection_rate = 0.0;
  c.max_centroid_rms_px = 100.0;
  const std::vector<std::string> said = not_met(c, Flight().score());
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0],
            "the detection rate is unknown, for no frame showed a target that could be detected; "
            "it must be at least 0");
}

TEST(Score, CriteriaAreReadFromTheScenarioAndZeroIsALimit) {
  const auto read = [](const std::string& text) {
    const ConfigReader config = ConfigReader::from_text("[criteria]\n" + text, "c.toml");
    const DetectionCriteria c = hil::read_criteria(config.table("criteria"));
    config.reject_unknown_keys();
    return c;
  };
  EXPECT_FALSE(read("").min_detection_rate);
  EXPECT_FALSE(read("").max_false_alarms_per_frame);
  const DetectionCriteria c = read(
      "min_detection_rate = 0.9\nmax_false_alarms_per_frame = 0\nmax_centroid_rms_px = 0.5\n"
      "max_latency_frames = 2\nmax_acquisition_s = 1.5\nmin_time_on_target = 0.8\n"
      "detectable_fraction = 0.3\ndetectable_signal_to_noise = 7\nmatch_margin_px = 2\n"
      "match_box_iou = 0.4\non_target_px = 10\n");
  EXPECT_EQ(c.min_detection_rate, 0.9);
  EXPECT_EQ(c.max_false_alarms_per_frame, 0.0);
  EXPECT_EQ(c.max_centroid_rms_px, 0.5);
  EXPECT_EQ(c.max_latency_frames, 2.0);
  EXPECT_EQ(c.max_acquisition_s, 1.5);
  EXPECT_EQ(c.min_time_on_target, 0.8);
  EXPECT_EQ(c.rules.min_visible_fraction, 0.3);
  EXPECT_EQ(c.rules.min_signal_to_noise, 7.0);
  EXPECT_EQ(c.rules.margin_px, 2.0);
  EXPECT_EQ(c.rules.min_box_iou, 0.4);
  EXPECT_EQ(c.rules.on_target_px, 10.0);
  EXPECT_THROW(read("min_detection_rate = 1.1\n"), ConfigError);
  EXPECT_THROW(read("max_latency_frames = -1\n"), ConfigError);
  EXPECT_THROW(read("min_detection_rat = 1\n"), ConfigError);
}

}  // namespace
