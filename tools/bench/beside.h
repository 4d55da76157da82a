#pragma once

#include <functional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

namespace bench {

/// What there is to time: pieces that are much alike, as the frames of a pass.
struct Work {
  std::function<void(int)> run;
  std::function<void(int)> before = [](int) {};  ///< what a piece needs done, not timed
  int pieces = 1;
};

/// What work is held against: something simpler that it cannot well do without.
struct Bound {
  std::string name;
  std::function<void()> run;
};

/// CPU times, the least of all turns.
struct Least {
  double work_s = 0;  ///< a piece, mean
  std::vector<double> bound_s;
};

/// A benchmark of work that stands beside its bounds: after each piece each bound has its turn, so
/// that load, clock and caches are the same for all. The benchmark's own times are the work's
/// alone. Counters: `bound_ms` is the first bound, `of_bound` the work as a multiple of it,
/// `of_<name>` of each further one. Ratios of one commit have differed by 15 % between two runs.
Least beside(benchmark::State& state, const Work& work, const std::vector<Bound>& bounds);

}  // namespace bench
