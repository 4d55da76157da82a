#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/starloop/scenario.h"

namespace chart {

/// What settings are tried on: an instant of a scenario with some of its values changed. One file
/// each, a table [scene]:
///   title = "the paper's pass at its closest"
///   scenario = "../flyby.toml"     path from this file's folder
///   time_s = 309781.706            shutter opens, after the scenario's epoch
///   set = ["run.exposure_ms=5"]    what is changed; none if it is not there
///   corner = true                  a place where methods fail; false if it is not there
struct ChartScene {
  std::string name;  ///< the file's
  std::string title;
  starloop::CommonOptions options;  ///< scenario and changes
  double time_s = 0;
  bool corner = false;

  /// The same with further changes.
  [[nodiscard]] starloop::Scenario with(const std::vector<std::string>& sets) const;
  /// A command that shows it.
  [[nodiscard]] std::string command() const;
};

/// Throws engine::ConfigError.
[[nodiscard]] ChartScene read_chart_scene(const std::filesystem::path& file);
/// All of a folder's, in alphabetical order. Throws engine::ConfigError, too when there is none.
[[nodiscard]] std::vector<ChartScene> read_chart_scenes(const std::filesystem::path& folder);

}  // namespace chart
