#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "tools/starloop/report_json.h"

namespace starloop {

/// Whether a run was good enough, by the scenario's criteria. An open loop is not judged.
struct Verdict {
  PointingScore whole;
  PointingScore held;
  DetectionVerdict detection;
  bool held_good = true;
  bool good = true;  ///< that, and what was asked of detections
};
[[nodiscard]] Verdict judge(const Scenario& scenario, const RunLog& log, bool open_loop);

/// What a run's report says besides the loop's own log.
struct RunFacts {
  engine::Pass pass;
  bool open_loop = false;
  int threads = 0;
  hil::RecorderReport recorder;
  const nlohmann::ordered_json& links;
  const nlohmann::ordered_json& faults_injected;
  const nlohmann::ordered_json& command_port;
  const nlohmann::ordered_json& truth;
  const nlohmann::ordered_json& image_quality;
};
/// report.json.
void write_report(const std::filesystem::path& folder, const Scenario& scenario, const RunLog& log,
                  const Verdict& verdict, const RunFacts& facts);
/// The end of a run, for people.
void print_summary(const Scenario& scenario, const RunLog& log, const Verdict& verdict,
                   bool open_loop);

}  // namespace starloop
