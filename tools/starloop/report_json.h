#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "hil/score.h"
#include "tools/starloop/run_folder.h"

namespace starloop {

/// How well a run's software under test saw, and what that had to be. Nothing is judged in an open
/// loop.
struct DetectionVerdict {
  hil::DetectionScore score;
  std::vector<hil::JudgedCriterion> criteria;
  std::vector<std::string> not_met;  ///< a sentence each
};
[[nodiscard]] DetectionVerdict judge_detections(const hil::DetectionCriteria& criteria,
                                                const engine::CameraGeometry& camera,
                                                const RunLog& log, bool open_loop);

/// report.json's "statistics": p50, p99, p99.9 and max of what was measured each frame.
[[nodiscard]] nlohmann::ordered_json statistics_json(const RunLog& log);
/// report.json's "detection".
[[nodiscard]] nlohmann::ordered_json detection_json(const DetectionVerdict& verdict);
/// detections.csv: a line for each frame that was handed over. Throws std::runtime_error.
void write_detections(const std::filesystem::path& folder, const RunLog& log,
                      const hil::DetectionScore& score);

}  // namespace starloop
