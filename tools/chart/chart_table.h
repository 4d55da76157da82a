#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "tools/chart/chart_scene.h"
#include "tools/chart/knobs.h"
#include "tools/chart/probe.h"
#include "tools/starloop/provenance.h"

namespace chart {

/// One setting on one scene.
struct Point {
  std::string kind;  ///< "standard", "single" or "mixed"
  Setting setting;
  int threads = 1;
  double cpu_ms = 0;  ///< a frame, median
  double cpu_ms_p99 = 0;
  double wall_ms = 0;
  double wall_ms_p99 = 0;
  int frames = 0;  ///< that were timed
  double set_up_s = 0;
  LightError error;
  std::string rungs;
};
[[nodiscard]] Point make_point(const std::string& kind, const Setting& setting, int threads,
                               const Probe& probe, const PixelSorter& sorter);

/// chart.csv: a row for each setting on each scene, what is not known left empty.
class ChartTable {
 public:
  /// Throws std::runtime_error.
  ChartTable(const std::filesystem::path& path, const starloop::Provenance& made_with);
  void add(const ChartScene& scene, double period_ms, const Point& point);
  /// Throws std::runtime_error when something of it is not on the disk.
  void close();

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  std::string made_with_;
};

}  // namespace chart
