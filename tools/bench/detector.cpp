// Noise and the detector.
#include <benchmark/benchmark.h>

#include "engine/core/random.h"
#include "engine/detector/detector.h"
#include "tools/bench/beside.h"
#include "tools/bench/bounds.h"

namespace {

using namespace engine;

void bench_poisson(benchmark::State& state) {
  const double mean = std::pow(10.0, static_cast<double>(state.range(0)));
  Draws draws(1, Stream::kShot, 0, 0);
  for (auto _ : state) benchmark::DoNotOptimize(draws.poisson(mean));
}
BENCHMARK(bench_poisson)->ArgName("log10_mean")->DenseRange(-2, 4, 1);

/// Electrons to DN on one thread: a frame of so many electrons a pixel; 0: the paper's dark sky
/// with a disc of 115 px that collects 15 000. 11 bits as in the paper, or 16 with a pedestal.
/// Beside a normal number a pixel, and beside the bytes alone.
void bench_detector_frame(benchmark::State& state) {
  DetectorSpec spec;
  spec.bits = static_cast<int>(state.range(1));
  if (spec.bits == 16) {
    spec.pedestal_dn = 100;
    spec.quantiser = Quantiser::kRound;
  }
  const Duration exposure = std::chrono::milliseconds(1);
  const double to_e = spec.electrons_per_irradiance(exposure);
  const auto level_e = static_cast<double>(state.range(0));
  IrradianceImage light(1024, 1024);
  for (int v = 0; v < 1024; ++v)
    for (int u = 0; u < 1024; ++u) {
      const double sky_e = level_e > 0.0 ? level_e : 1e-3;
      const bool lit = level_e == 0.0 && std::hypot(u - 512, v - 512) < 57.5;
      // The disc is no plane: each of its pixels has a mean of its own.
      light.at(u, v) = static_cast<float>((lit ? 15000.0 + u + 0.3 * v : sky_e) / to_e);
    }
  WorkerPool pool(1);
  const Detector detector(spec, pool);
  ElectronImage electrons;
  DnImage dn;
  std::uint64_t frame = 0;
  bench::SensorBounds sensor(light.pixels().size());
  const auto one_frame = [&](int) {
    detector.expose(light, exposure, 1, frame, electrons);
    detector.digitize(electrons, 1, frame++, dn);
    benchmark::ClobberMemory();
  };
  bench::beside(
      state, {.run = one_frame},
      {{"numbers", [&] { sensor.draw_numbers(); }}, {"memory", [&] { sensor.move_bytes(); }}});
}
BENCHMARK(bench_detector_frame)
    ->ArgNames({"electrons", "bits"})
    ->ArgsProduct({{0, 1, 8, 15, 30, 100, 15000}, {11, 16}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
