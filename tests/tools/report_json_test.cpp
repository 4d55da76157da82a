#include "tools/starloop/report_json.h"

#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace {

using engine::Duration;
using nlohmann::json;
using starloop::DetectionVerdict;
using starloop::RunLog;

/// A hundred frames: 1 ms late, 2 ms, ... 100 ms; every tenth dropped; answered at once, and
/// detected but for the first five.
RunLog hundred_frames() {
  RunLog log;
  for (std::uint64_t i = 0; i < 100; ++i) {
    hil::FrameRecord r;
    r.sequence = i;
    r.late = Duration(static_cast<std::int64_t>(i + 1) * 1'000'000);
    r.handed_over = i % 10 != 9;
    if (r.handed_over) {
      r.busy = Duration(7'000'000);
      r.report.times.render = Duration(5'000'000);
      r.report.truth.photocentre_px = {512, 512};
      r.report.truth.box = {500, 500, 524, 524};
      r.report.truth.visible_fraction = 1.0;
      r.report.truth.signal_to_noise = 100.0;
      hil::Command c;
      c.answers_frame = i;
      if (i >= 5) c.detection = {.centroid_px = {512.5, 512}, .confidence = 1.0F};
      log.commands.push_back({i + 1, c});
    }
    log.frames.push_back(r);
  }
  return log;
}

DetectionVerdict verdict_with(double min_rate, bool open_loop) {
  hil::DetectionCriteria criteria;
  criteria.min_detection_rate = min_rate;
  return starloop::judge_detections(criteria, {}, hundred_frames(), open_loop);
}

TEST(ReportJson, StatisticsAreOfTheFramesThatHaveThem) {
  const json s = starloop::statistics_json(hundred_frames());
  EXPECT_EQ(s.at("late"), (json{{"unit", "ms"},
                                {"count", 100},
                                {"p50", 50.0},
                                {"p99", 99.0},
                                {"p99_9", 100.0},
                                {"max", 100.0}}));
  // A dropped frame was not rendered: its zeros would only flatter.
  EXPECT_EQ(s.at("busy").at("count"), 90);
  EXPECT_EQ(s.at("render").at("p50"), 5.0);
  EXPECT_EQ(s.at("latency").at("count"), 90);
  EXPECT_EQ(s.at("latency").at("max"), 1.0);
}

TEST(ReportJson, OfARunWithoutFramesEveryFigureIsNull) {
  const json s = starloop::statistics_json({});
  EXPECT_TRUE(s.at("late").at("p99").is_null());
  const json d = starloop::detection_json(starloop::judge_detections({}, {}, {}, false));
  EXPECT_TRUE(d.at("detection_rate").is_null());
  EXPECT_TRUE(d.at("centroid_error").at("rms").is_null());
  EXPECT_TRUE(d.at("box_iou_mean").is_null());
}

TEST(ReportJson, DetectionSaysWhatWasReachedAndWhetherThatWasEnough) {
  for (const auto& [min_rate, met] : {std::pair(0.9, true), std::pair(0.99, false)}) {
    const DetectionVerdict verdict = verdict_with(min_rate, false);
    const json d = starloop::detection_json(verdict);
    EXPECT_EQ(d.at("detected"), 85);
    EXPECT_EQ(d.at("detectable"), 90);
    EXPECT_EQ(d.at("centroid_error").at("rms"), 0.5);
    EXPECT_EQ(d.at("centroid_error").at("bias_u"), 0.5);
    ASSERT_EQ(d.at("criteria").size(), 1U);
    const json& c = d.at("criteria").at(0);
    EXPECT_EQ(c.at("key"), "min_detection_rate");
    EXPECT_EQ(c.at("limit"), min_rate);
    EXPECT_NEAR(c.at("reached"), 85.0 / 90.0, 1e-12);
    EXPECT_EQ(c.at("met"), met);
    EXPECT_EQ(verdict.not_met.empty(), met);
  }
  EXPECT_TRUE(verdict_with(0.99, true).not_met.empty()) << "an open loop is not judged";
}

TEST(ReportJson, DetectionsHasALineForEachFrameThatWasHandedOver) {
  const test_support::TemporaryFolder folder;
  const RunLog log = hundred_frames();
  starloop::write_detections(folder.path(), log, verdict_with(0.9, false).score);
  std::istringstream text(test_support::content_of(folder.path() / "detections.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 91U);
  EXPECT_EQ(lines[1], "0,0.000000000,1.000000,100.0000,0,1,1,0,0,nan,nan,nan,1");
  EXPECT_EQ(lines[10], "10,0.000000000,1.000000,100.0000,0,1,1,1,0,0.5000,0.0000,nan,1");
}

}  // namespace
