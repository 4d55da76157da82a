// Light spread on the detector.
#include <benchmark/benchmark.h>

#include "engine/core/random.h"
#include "tools/bench/beside.h"
#include "tools/bench/scenes.h"
#include "tools/bench/transform.h"

namespace {

using namespace engine;

/// Optics alone on one thread: a patched disc so many pixels across, smeared by so many, or on a
/// path of a swing of that amplitude. Beside a bare transform of its grid there and back.
void bench_optics(benchmark::State& state) {
  const starloop::Scenario scenario = bench::scenario_of("flyby");
  const double to_e = scenario.detector.electrons_per_irradiance(scenario.run.exposure);
  WorkerPool pool(1);
  Optics optics(scenario.optics, 0.3 * scenario.detector.noise_e(0.0) / to_e, pool);
  const auto across = static_cast<int>(state.range(0));
  Radiance in;
  const int corner = 512 - across / 2;
  in.region = {corner, corner, corner + across, corner + across};
  in.grid.resize(3 * across, 3 * across);
  const auto moves_px = static_cast<double>(state.range(1));
  in.path.bends = state.range(2) != 0;
  if (!in.path.bends) in.motion_px = {moves_px, 0.0};
  for (int i = 0; in.path.bends && i <= ImagePath::kSteps; ++i)
    in.path.off_px[static_cast<std::size_t>(i)] = {
        0.0, moves_px * std::sin(2.0 * kPi * i / ImagePath::kSteps)};
  const double bright = 15000.0 / (to_e * optics.throughput_sr());
  for (int v = 0; v < 3 * across; ++v)
    for (int u = 0; u < 3 * across; ++u) {
      const bool lit = std::hypot(u - 1.5 * across, v - 1.5 * across) < 1.5 * across;
      in.grid.at(u, v) = lit && (u / 40 + v / 33) % 3 != 0 ? static_cast<float>(bright) : 0.0F;
    }
  IrradianceImage out;
  OpticsReport report;
  report = optics.project(in, out);
  const int side_cells = 3 * Blur::fast_length(across + 2 * report.core_px);
  bench::Transform transform(side_cells, side_cells);
  bench::beside(state, {.run = [&](int) { report = optics.project(in, out); }},
                {{"transforms", [&] { transform.there_and_back(); }}});
  state.counters["wing_px"] = report.wing_px;
  state.counters["side_cells"] = side_cells;
}
BENCHMARK(bench_optics)
    ->ArgNames({"across_px", "smear_px", "path"})
    ->ArgsProduct({{1, 10, 60, 110, 130, 800, 1000}, {0}, {0}})
    ->ArgsProduct({{110}, {3, 146, 1000}, {0}})
    ->ArgsProduct({{110}, {3, 80}, {1}})
    ->Unit(benchmark::kMillisecond);

/// Stars onto the detector of the paper's camera, each 300 e- in a millisecond; footprints a
/// second.
void bench_star_footprints(benchmark::State& state) {
  const starloop::Scenario scenario = bench::scenario_of("flyby");
  const CameraGeometry& camera = scenario.scene.camera;
  const double to_e = scenario.detector.electrons_per_irradiance(scenario.run.exposure);
  const double faint_w_m2 = 0.3 * scenario.detector.noise_e(0.0) / to_e;
  WorkerPool pool(static_cast<int>(state.range(1)));
  PointSplat splat(scenario.optics, OtfCascade(scenario.optics), faint_w_m2, pool);
  std::vector<PointSource> stars(10000);
  Draws draws(1, Stream::kShot, 0, 0);
  for (PointSource& star : stars)
    star = {{camera.width_px * draws.uniform_double(), camera.height_px * draws.uniform_double()},
            300.0 / (to_e * splat.pixels_per_irradiance()),
            {static_cast<double>(state.range(0)), 0.0}};
  IrradianceImage image(camera.width_px, camera.height_px);
  std::uint64_t footprints = 0;
  for (auto _ : state) footprints += splat.add(stars, {}, image).footprints;
  state.counters["footprints_s"] =
      benchmark::Counter(static_cast<double>(footprints), benchmark::Counter::kIsRate);
  state.counters["reach_px"] = splat.reach_px(stars[0].irradiance_w_m2);
}
BENCHMARK(bench_star_footprints)
    ->ArgNames({"streak_px", "threads"})
    ->ArgsProduct({{0, 10}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
