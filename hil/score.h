#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "hil/loop_report.h"
#include "hil/percentiles.h"

namespace hil {

/// When a target counts as there to be seen, and a detection as seeing it.
struct DetectionRules {
  double min_visible_fraction = 0.5;  ///< in [0, 1]
  double min_signal_to_noise = 10;    ///< of the whole mask
  double margin_px = 3;               ///< a centroid this far outside the true box still counts
  double min_box_iou = 0.5;           ///< and so does a box that overlaps the true one by this
  double on_target_px = 5;            ///< photocentre to boresight
};

/// What a run must reach; nothing for what nobody asked for. 0 is a limit like any other.
struct DetectionCriteria {
  DetectionRules rules;
  std::optional<double> min_detection_rate;
  std::optional<double> max_false_alarms_per_frame;
  std::optional<double> max_centroid_rms_px;
  std::optional<double> max_latency_frames;
  std::optional<double> max_acquisition_s;
  std::optional<double> min_time_on_target;
};
[[nodiscard]] DetectionCriteria read_criteria(const engine::ConfigTable& table);

/// One frame that the software under test was given.
struct FrameVerdict {
  std::uint64_t sequence = 0;
  bool answered = false;    ///< by a command of any kind
  bool detectable = false;  ///< by the rules
  bool found = false;       ///< a detection matches; frames that are not detectable may be, too
  std::uint32_t false_alarms = 0;
  /// Of the match: detected centroid less photocentre. Not a number without one.
  engine::PixelPoint error_px{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::quiet_NaN()};
  std::optional<double> box_iou;  ///< of the match, when it gave a box
  /// From this frame to the first that could show its last answer.
  std::optional<std::uint64_t> latency_frames;
};

/// How well the software under test saw, by the truth of what it was shown.
///
/// Frames: those handed over to the link, as recorded. A detection matches when its centroid lies
/// within the mask's box grown by the margin, or its box overlaps that box enough; of several, the
/// one nearest to the photocentre is the match, and the others are false alarms: there is one
/// target. Where a mask is empty the photocentre stands for its box. A match in a frame that is not
/// detectable counts neither for nor against.
/// Counts that add up: detections == matches + false_alarms + duplicates + strays, and
/// frames == answered + unanswered.
struct DetectionScore {
  std::uint64_t frames = 0;
  std::uint64_t answered = 0;
  std::uint64_t unanswered = 0;
  std::uint64_t detectable = 0;
  std::uint64_t detected = 0;      ///< of these
  std::uint64_t detections = 0;    ///< heard, of any kind
  std::uint64_t matches = 0;       ///< in detectable frames and others
  std::uint64_t false_alarms = 0;  ///< nothing is there, or something that is matched already
  std::uint64_t duplicates = 0;    ///< say again what was said of the same frame under the same id
  std::uint64_t strays = 0;        ///< of frames never handed over, or not before the answer
  std::optional<double> detection_rate;  ///< detected / detectable
  std::optional<double> false_alarms_per_frame;
  double centroid_rms_px = 0;           ///< with the rest below, over `detected` frames
  engine::PixelPoint centroid_bias_px;  ///< mean of detected less true
  Percentiles centroid_error_px;
  double centroid_p95_px = 0;
  std::uint64_t boxes = 0;  ///< matches that gave one
  double box_iou_mean = 0;
  Percentiles latency_frames;            ///< of each answer, not only of the last to a frame
  std::optional<double> acquisition_s;   ///< first detectable frame to first detected, by shutter
  std::optional<double> time_on_target;  ///< share of frames
  std::vector<FrameVerdict> verdicts;    ///< a frame each
};

/// Frames ascend in sequence, as the loop records them. For after a run: it allocates.
[[nodiscard]] DetectionScore score_detections(std::span<const FrameRecord> frames,
                                              std::span<const CommandRecord> commands,
                                              const DetectionRules& rules,
                                              engine::PixelPoint boresight_px);

/// What became of one criterion. What could not be measured was not met.
struct JudgedCriterion {
  std::string key;  ///< in the scenario
  double limit = 0;
  std::optional<double> reached;
  bool met = false;
  std::string sentence;  ///< what was reached and what was asked for
};
/// Of those that were asked for.
[[nodiscard]] std::vector<JudgedCriterion> judge_detections(const DetectionCriteria& criteria,
                                                            const DetectionScore& score);
/// The sentences of those that were not met.
[[nodiscard]] std::vector<std::string> criteria_not_met(std::span<const JudgedCriterion> criteria);

}  // namespace hil
