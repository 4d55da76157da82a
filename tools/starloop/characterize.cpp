#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "tools/characterize/camera_report.h"
#include "tools/characterize/report_files.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
}

characterize::CameraReport measure(const Scenario& scenario, int threads) {
  const engine::CameraGeometry& camera = scenario.scene.camera;
  engine::WorkerPool pool(worker_threads(threads));
  engine::Optics optics(scenario.optics, faint_irradiance_w_m2(scenario), pool);
  const engine::SensorMaps maps = sensor_maps(scenario);
  characterize::CameraReport report;
  report.scenario = scenario.name;
  report.camera = camera;
  // What cannot be measured is said before the rest is.
  for (const bool near_vertical : {true, false})
    (void)characterize::edge_reach_px(camera, near_vertical, {});
  const characterize::RecordPlan plan;
  const auto add_depth = [&](const engine::DetectorSpec& spec) {
    report.sensors.push_back(characterize::characterize_sensor(
        optics, spec, maps, camera, pool, scenario.scene.seed, scenario.run.exposure, plan));
  };
  constexpr int kDeepest = 16;
  const int bits = scenario.detector.bits;
  try {
    add_depth(scenario.detector);
  } catch (const std::runtime_error& e) {
    if (bits == kDeepest) throw;
    report.refused = std::to_string(bits) + " bits cannot be measured: " + e.what();
  }
  if (bits < kDeepest) add_depth(characterize::at_16_bits(scenario.detector));
  report.edges =
      characterize::characterize_edges(optics, scenario.optics, report.sensors.back(), maps, pool,
                                       scenario.scene.seed, scenario.run.exposure);
  report.missed = characterize::missed_limits(report);
  return report;
}

}  // namespace

int characterize_camera(const CommonOptions& options, const std::string& out) {
  const Scenario scenario = load_scenario(options);
  make_folder(out);
  characterize::CameraReport report;
  try {
    report = measure(scenario, options.threads);
  } catch (const engine::ConfigError&) {
    throw;
  } catch (const std::runtime_error& e) {
    // A camera that this bench cannot measure.
    throw engine::ConfigError(options.file + ": " + e.what());
  }
  characterize::write_files(out, report);
  const bool drawn = run_plot_script("characterize.py", out);
  std::printf("%s", characterize::text_of(report).c_str());
  if (!options.quiet) {
    std::printf("%s: report.json, report.txt, tables and pictures\n", out.c_str());
    if (!drawn) std::printf("no pictures: /usr/bin/python3 with matplotlib did not draw them\n");
  }
  return report.missed.empty() ? kGood : kCriterionFailed;
}

}  // namespace starloop
