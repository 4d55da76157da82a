// Whole frames as a run has them, on one thread and on two, and what their score costs.
#include <benchmark/benchmark.h>

#include "tools/bench/scenes.h"
#include "tools/quality/image_quality.h"
#include "tools/starloop/rig.h"

namespace {

using namespace engine;

/// A frame of the paper's pass, so many seconds after its closest point; stages as counters.
void expose_flyby(benchmark::State& state, const starloop::Scenario& scenario, double after_s,
                  int threads) {
  starloop::Rig rig(scenario, threads);
  Shot shot = rig.predicted_shot(sim_time(bench::kClosest_s + after_s), scenario.run.exposure);
  DnImage image(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  TruthMask mask;
  FrameReport report;
  double render_s = 0;
  double optics_s = 0;
  double detector_s = 0;
  for (auto _ : state) {
    ++shot.sequence;
    report = rig.generator().expose(shot, Budget{}, image, mask);
    render_s += seconds(report.times.render);
    optics_s += seconds(report.times.optics);
    detector_s += seconds(report.times.detector);
  }
  const auto per_frame_ms = benchmark::Counter::kAvgIterations;
  state.counters["render_ms"] = benchmark::Counter(render_s * 1e3, per_frame_ms);
  state.counters["optics_ms"] = benchmark::Counter(optics_s * 1e3, per_frame_ms);
  state.counters["detector_ms"] = benchmark::Counter(detector_s * 1e3, per_frame_ms);
  state.counters["range_km"] = report.truth.range_m * 1e-3;
  state.counters["rays"] = static_cast<double>(report.render.rays);
}

/// What a score of such a frame costs the thread that sends it.
void bench_image_quality(benchmark::State& state) {
  const starloop::Scenario scenario = bench::scenario_of("flyby");
  starloop::Rig rig(scenario, 1);
  const double after_s = static_cast<double>(state.range(0));
  const Shot shot =
      rig.predicted_shot(sim_time(bench::kClosest_s + after_s), scenario.run.exposure);
  DnImage image(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  TruthMask mask;
  rig.generator().expose(shot, Budget{}, image, mask);
  quality::Meter meter(image.width(), image.height());
  const quality::CameraFigures camera{scenario.detector.largest_dn(),
                                      scenario.detector.gain_e_dn()};
  quality::ImageQuality quality;
  for (auto _ : state) benchmark::DoNotOptimize(quality = meter.measure(image, camera));
  state.counters["lit_px"] = quality.lit_px;
}
BENCHMARK(bench_image_quality)
    ->ArgName("s_after_closest")
    ->Arg(0)
    ->Arg(20)
    ->Unit(benchmark::kMillisecond);

void bench_frame(benchmark::State& state) {
  expose_flyby(state, bench::scenario_of("flyby"), static_cast<double>(state.range(0)),
               static_cast<int>(state.range(1)));
}
BENCHMARK(bench_frame)
    ->ArgNames({"s_after_closest", "threads"})
    ->ArgsProduct({{0, 5, 10, 20}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// With companions in a row, so many metres from one to the next: at 16 m beside the target in the
/// frame, at 5 km out of it.
void bench_frame_of_bodies(benchmark::State& state) {
  std::vector<std::string> companions;
  for (int i = 1; i < state.range(0); ++i)
    companions.push_back("companions.c" + std::to_string(i) +
                         ".cross_m=" + std::to_string(i * state.range(1)));
  expose_flyby(state, bench::scenario_of("flyby", companions), 0.0, 1);
}
BENCHMARK(bench_frame_of_bodies)
    ->ArgNames({"bodies", "metres_apart"})
    ->ArgsProduct({{1, 2, 4}, {16, 5000}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
