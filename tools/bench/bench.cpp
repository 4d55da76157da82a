// What each model costs. Machines are shared and noisy: compare lines of one run with each other,
// or two commits by tools/bench/compare, never with a number from another day. `of_bound` is a
// multiple of something simpler in the same run: docs/benchmarks.md.
//   build/release/bench                       everything
//   build/release/bench --benchmark_filter=stage
// A file a room: orbit.cpp, scene.cpp, meshes.cpp, optics.cpp, detector.cpp, links.cpp, frame.cpp;
// the stages of a frame beside their bounds, and the whole of it: stages.cpp.
#include <benchmark/benchmark.h>

BENCHMARK_MAIN();
