#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/chart/chart_scene.h"
#include "tools/chart/knobs.h"
#include "tools/chart/light_error.h"

namespace chart {

/// How many frames a setting is tried on. Those before the scene's instant are one period apart, as
/// in a run: what a renderer keeps from frame to frame it has by then.
struct ProbeSpec {
  int before = 12;   ///< not timed
  int timed = 12;    ///< up to the instant
  int repeated = 4;  ///< of the instant, each with other random numbers: their light is compared
  int threads = 1;
};

/// What a setting cost and showed.
struct Probe {
  std::vector<double> cpu_ms;   ///< of each timed frame, all threads together
  std::vector<double> wall_ms;  ///< of the same
  std::vector<engine::StageTimes> stages;
  double set_up_s = 0;
  LightStack light;
  engine::FrameReport report;  ///< of the last frame
  engine::TruthMask mask;
  std::string rungs;  ///< "method lattice, bounces 1": what the program chose
};

/// Thread: any. Throws engine::ConfigError where the setting is none for this scene.
[[nodiscard]] Probe try_setting(const ChartScene& scene, const std::vector<std::string>& sets,
                                const ProbeSpec& spec);

/// The share-th quantile of what is given, by its own values; not a number of none.
[[nodiscard]] double quantile(std::vector<double> values, double share);

}  // namespace chart
