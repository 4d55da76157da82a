// The stages of a frame of the paper's pass, and the whole of it, each beside what bounds it:
// docs/benchmarks.md says what each bound means. One thread; the argument is seconds after the
// closest point of the pass: 69, 161 and 299 km.
#include <benchmark/benchmark.h>

#include "tools/bench/beside.h"
#include "tools/bench/bounds.h"
#include "tools/bench/pass_frames.h"

namespace {

using namespace engine;
using bench::PassFrames;

constexpr int kFrames = 8;
constexpr int kBefore = 30;  // frames, until what is kept on the body is there

/// One frame is made, after so many that came before it: its bounds are known then.
void warm_up(PassFrames& frames, int before = 0) {
  frames.settle(before);
  frames.geometry(0);
  frames.render();
  frames.optics();
  frames.detector();
}

void bench_stage_geometry(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), kFrames);
  bench::Places places(frames);
  bench::beside(state, {.run = [&](int i) { frames.geometry(i); }, .pieces = kFrames},
                {{"places", [&] { places.find(); }}});
}

/// `of_own_rays`: as a multiple of the rays alone that it says it sent, at Embree's rate for rays
/// that go anywhere.
void bench_stage_render(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), kFrames);
  warm_up(frames, kBefore);
  const bench::PictureRays rays(frames);
  double own_rays = 0;
  const bench::Work work{.run =
                             [&](int) {
                               frames.render();
                               own_rays += static_cast<double>(frames.rendered().rays);
                             },
                         .before = [&](int i) { frames.geometry(i); },
                         .pieces = kFrames};
  const bench::Least least = bench::beside(
      state, work,
      {{"picture", [&] { rays.trace(); }}, {"bounced", [&] { rays.trace_bounced(); }}});
  const double per_frame = own_rays / static_cast<double>(state.iterations());
  state.counters.erase("of_bounced");
  state.counters["rays"] = per_frame;
  state.counters["of_own_rays"] = least.work_s / (per_frame * least.bound_s[1] / rays.bounced());
}

void bench_stage_optics(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), 1);
  warm_up(frames);
  bench::Transform transform = bench::transform_of(frames);
  bench::beside(state, {.run = [&](int) { frames.optics(); }},
                {{"transforms", [&] { transform.there_and_back(); }}});
}

void bench_stage_detector(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), 1);
  warm_up(frames);
  bench::SensorBounds sensor(frames.image().pixels().size());
  bench::beside(
      state, {.run = [&](int) { frames.detector(); }},
      {{"numbers", [&] { sensor.draw_numbers(); }}, {"memory", [&] { sensor.move_bytes(); }}});
}

void bench_stage_link(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), 1);
  warm_up(frames);
  bench::FrameCopy copy(frames.image().pixels().size());
  bench::beside(state, {.run = [&](int) { frames.link(); }}, {{"copy", [&] { copy.copy(); }}});
}

/// From shutter to bytes, with what a frame's truth takes besides the stages.
void bench_stage_all(benchmark::State& state) {
  PassFrames frames(static_cast<double>(state.range(0)), kFrames);
  warm_up(frames);
  bench::Places places(frames);
  const bench::PictureRays rays(frames);
  bench::Transform transform = bench::transform_of(frames);
  bench::SensorBounds sensor(frames.image().pixels().size());
  bench::FrameCopy copy(frames.image().pixels().size());
  ImagingChain chain = frames.rig().make_chain(frames.scenario());
  TruthMask mask;
  const auto expose = [&](const Shot& shot) { chain.expose(shot, Budget{}, frames.image(), mask); };
  for (int k = 0; k < kBefore; ++k) expose(frames.shot(k % kFrames));
  const bench::Work work{.run =
                             [&](int i) {
                               expose(frames.shot(i));
                               frames.link();
                             },
                         .pieces = kFrames};
  bench::beside(state, work, {{"stages", [&] {
                                 places.find();
                                 rays.trace();
                                 transform.there_and_back();
                                 sensor.draw_numbers();
                                 copy.copy();
                               }}});
}

/// Fixed numbers of turns, for setting up takes longer than they do.
void times(benchmark::internal::Benchmark* b) {
  b->ArgName("s_after_closest")->Arg(0)->Arg(10)->Arg(20)->Unit(benchmark::kMillisecond);
}
BENCHMARK(bench_stage_geometry)->Apply(times)->Iterations(2000)->Unit(benchmark::kMicrosecond);
BENCHMARK(bench_stage_render)->Apply(times)->Iterations(4 * kFrames);
BENCHMARK(bench_stage_optics)->Apply(times)->Iterations(200);
BENCHMARK(bench_stage_detector)->Apply(times)->Iterations(200);
BENCHMARK(bench_stage_link)->Apply(times)->Iterations(400);
BENCHMARK(bench_stage_all)->Apply(times)->Iterations(4 * kFrames);

}  // namespace
