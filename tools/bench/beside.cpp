#include "tools/bench/beside.h"

#include "tools/bench/least_times.h"

namespace bench {

Least beside(benchmark::State& state, const Work& work, const std::vector<Bound>& bounds) {
  LeastTimes pieces(static_cast<std::size_t>(work.pieces));
  LeastTimes yardsticks(bounds.size());
  int piece = 0;
  for (auto _ : state) {
    state.PauseTiming();
    work.before(piece);
    state.ResumeTiming();
    pieces.time(static_cast<std::size_t>(piece), [&] { work.run(piece); });
    state.PauseTiming();
    for (std::size_t k = 0; k < bounds.size(); ++k) yardsticks.time(k, bounds[k].run);
    piece = (piece + 1) % work.pieces;
    state.ResumeTiming();
  }
  Least least{pieces.mean_s(), {}};
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    least.bound_s.push_back(yardsticks.least_s(k));
    const std::string name = k == 0 ? "of_bound" : "of_" + bounds[k].name;
    state.counters[name] = least.work_s / least.bound_s[k];
  }
  state.counters["bound_ms"] = 1e3 * least.bound_s.front();
  return least;
}

}  // namespace bench
