// The hot loops of a frame of the paper's pass, for callgrind to count their instructions, a
// dump a stage: tools/bench/instructions.py runs it. With an argument it says what it was built
// with.
#include <valgrind/callgrind.h>

#include <cstdio>

#include "tools/bench/pass_frames.h"

namespace {

constexpr double kAfterClosest_s = 0.0;
constexpr int kBefore = 1;  // frame: what a renderer keeps on the body is begun
constexpr int kFrames = 1;

/// Counts what is done in `stage`, and nothing besides.
template <typename Stage>
void counted(const char* name, Stage&& stage) {
  CALLGRIND_START_INSTRUMENTATION;
  stage();
  CALLGRIND_STOP_INSTRUMENTATION;
  CALLGRIND_DUMP_STATS_AT(name);
}

}  // namespace

int main(int argc, char**) {
  if (argc > 1) return std::puts(STARLOOP_BUILT_WITH) < 0;
  bench::PassFrames frames(kAfterClosest_s, kFrames);
  frames.settle(kBefore);
  for (int i = 0; i < kFrames; ++i) {
    frames.geometry(i);
    counted("render", [&] { frames.render(); });
    counted("optics", [&] { frames.optics(); });
    counted("detector", [&] { frames.detector(); });
    counted("link", [&] { frames.link(); });
  }
  return 0;
}
