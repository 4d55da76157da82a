#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tools/chart/chart_table.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

using chart::ChartScene;
using chart::Probe;
using chart::ProbeSpec;
using chart::Setting;

/// How much is tried.
struct Extent {
  std::size_t mixed;
  int before;
  int timed;
  int repeated;
  double reference_samples;  ///< of all lit pixels together, in each of the reference's frames
  int reference_frames;
};
constexpr Extent kQuick{12, 6, 9, 3, 10e6, 3};
constexpr Extent kFull{64, 12, 100, 16, 200e6, 4};

// A large target has fewer frames, of which each looks at more pixels.
constexpr double kFewFrames_px = 20e3;
constexpr int kLeastFrames = 3;

int fewer(int frames, int lit_px) {
  const double share = std::min(1.0, kFewFrames_px / std::max(lit_px, 1));
  return std::max(std::min(frames, kLeastFrames), static_cast<int>(frames * share));
}

/// In a quick chart: the rungs that are known to matter.
bool is_quick(const Setting& setting) {
  if (setting.name == "samples=auto") return false;  // seconds a frame
  static const std::vector<std::string> kKnobs = {"method",  "profile", "lattice",
                                                  "samples", "bounces", "earthshine",
                                                  "grid",    "wings",   "far target"};
  return std::find(kKnobs.begin(), kKnobs.end(), setting.knob) != kKnobs.end();
}

struct Task {
  std::string kind;
  Setting setting;
  int threads;
};

std::vector<Task> tasks_of(const ChartOptions& options, const Extent& extent) {
  std::vector<Task> tasks = {{"standard", chart::standard_setting(), 1}};
  for (const std::string& sets : options.tried) {
    Setting own = chart::standard_setting();
    own.name = sets;
    std::istringstream words(sets);
    for (std::string word; words >> word;) own.sets.push_back(word);
    tasks.push_back({"own", own, 1});
  }
  if (options.tried_alone) return tasks;
  Setting two = chart::standard_setting();
  two.name = "threads=2";
  two.knob = "threads";
  tasks.push_back({"single", two, 2});
  for (const Setting& s : chart::single_settings())
    if (options.full || is_quick(s)) tasks.push_back({"single", s, 1});
  for (const Setting& s : chart::mixed_settings(extent.mixed, 1)) tasks.push_back({"mixed", s, 1});
  return tasks;
}

class SceneCharter {
 public:
  SceneCharter(const ChartScene& scene, const ChartOptions& options, const Extent& extent)
      : scene_(scene), options_(options), extent_(extent), scenario_(scene.with({})) {}

  void run(chart::ChartTable& table) {
    // How large it is decides how many frames it gets.
    const int lit_px = chart::try_setting(scene_, {}, {0, 0, 1, 1}).report.truth.mask_px;
    const ProbeSpec spec{extent_.before, fewer(extent_.timed, lit_px),
                         fewer(extent_.repeated, lit_px), 1};
    const int samples = static_cast<int>(
        std::clamp(extent_.reference_samples / std::max(lit_px, 1), 64.0, 20000.0));
    const Probe reference = chart::try_setting(scene_, chart::reference_setting(samples).sets,
                                               {0, 0, extent_.reference_frames, worker_count()});
    const chart::PixelSorter sorter(reference.light, reference.mask, scenario_.detector,
                                    scenario_.run.exposure);
    std::printf("%s: %s; %d px lit, reference %d x %d samples\n", scene_.name.c_str(),
                scene_.title.c_str(), reference.report.truth.mask_px, extent_.reference_frames,
                samples);
    for (const Task& task : tasks_of(options_, extent_)) try_task(task, spec, sorter, table);
  }

 private:
  [[nodiscard]] static int worker_count() { return 0; }  // one for each processor

  void try_task(const Task& task, ProbeSpec spec, const chart::PixelSorter& sorter,
                chart::ChartTable& table) const {
    spec.threads = task.threads;
    try {
      const chart::Point point =
          chart::make_point(task.kind, task.setting, task.threads,
                            chart::try_setting(scene_, task.setting.sets, spec), sorter);
      table.add(scene_, 1e3 * engine::seconds(scenario_.run.period), point);
      if (!options_.quiet) tell(point);
    } catch (const engine::ConfigError& e) {
      // Not every rung is one of every scene; that is said, and is no row.
      std::printf("  %-26s %s\n", task.setting.name.c_str(), e.what());
    }
  }

  static void tell(const chart::Point& p) {
    std::printf("  %-26s %8.1f ms  lit %7.3f  edge %7.3f  sky %6.3f  flux %+8.3f %%  %7.4f px\n",
                p.setting.name.c_str(), p.cpu_ms, p.error.lit.rho, p.error.edge.rho,
                p.error.sky.rho, 100.0 * p.error.flux_share, p.error.centroid_px);
    std::fflush(stdout);
  }

  const ChartScene& scene_;
  const ChartOptions& options_;
  const Extent& extent_;
  Scenario scenario_;
};

std::vector<ChartScene> scenes_of(const ChartOptions& options) {
  std::vector<ChartScene> scenes;
  for (const std::string& path : options.scenes) {
    if (std::filesystem::is_directory(path)) {
      const auto more = chart::read_chart_scenes(path);
      scenes.insert(scenes.end(), more.begin(), more.end());
    } else {
      scenes.push_back(chart::read_chart_scene(path));
    }
  }
  return scenes;
}

}  // namespace

int chart_settings(const ChartOptions& options) {
  const Extent& extent = options.full ? kFull : kQuick;
  const std::vector<ChartScene> scenes = scenes_of(options);
  const std::filesystem::path folder = options.out;
  std::filesystem::create_directories(folder);
  const std::filesystem::path path = folder / "chart.csv";
  chart::ChartTable table(path, provenance());
  for (const ChartScene& scene : scenes) SceneCharter(scene, options, extent).run(table);
  table.close();
  const bool drawn = run_plot_script("chart.py", path.string());
  std::printf("%s\n%s\n", path.c_str(),
              drawn ? (folder / "chart.html").c_str()
                    : "no picture: /usr/bin/python3 with matplotlib did not draw it");
  return kGood;
}

}  // namespace starloop
