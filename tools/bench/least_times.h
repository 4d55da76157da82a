#pragma once

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <limits>
#include <vector>

namespace bench {

/// The least CPU time that each of several pieces of work took, of all its turns. Who takes them in
/// turn has them under the same load; the least has what other programs cost in it the least.
class LeastTimes {
 public:
  explicit LeastTimes(std::size_t pieces) : least_s_(pieces, kNever) {}

  template <class Work>
  void time(std::size_t piece, const Work& work) {
    const double start = cpu_s();
    work();
    least_s_[piece] = std::min(least_s_[piece], cpu_s() - start);
  }
  [[nodiscard]] double least_s(std::size_t piece) const { return least_s_[piece]; }
  /// Of the pieces that had a turn.
  [[nodiscard]] double mean_s() const {
    double sum_s = 0;
    int pieces = 0;
    for (const double s : least_s_) {
      if (s == kNever) continue;
      sum_s += s;
      ++pieces;
    }
    return sum_s / pieces;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// Of all threads of the program.
  [[nodiscard]] static double cpu_s() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  std::vector<double> least_s_;
};

}  // namespace bench
