#pragma once

#include <cstddef>
#include <vector>

namespace hil {

/// How bad it gets, and how often: the figures that cameras and real-time systems are judged by.
///
/// By nearest rank, without interpolation: p99 is the smallest of the values that at least 99 % of
/// them do not exceed, so each figure is a value that occurred. Of fewer than a hundred values p99
/// is the largest, of fewer than a thousand p99.9 is.
struct Percentiles {
  std::size_t count = 0;  ///< values that are numbers; 0: the figures below mean nothing
  double p50 = 0;
  double p99 = 0;
  double p99_9 = 0;
  double max = 0;
};

/// What is not a number is left out. Thread: any, after a run: it sorts.
[[nodiscard]] Percentiles percentiles_of(std::vector<double> values);

/// The smallest of `sorted` that at least `per_mille` of a thousand do not exceed.
/// Pre: not empty, ascending; per_mille in [1, 1000].
[[nodiscard]] double nearest_rank(const std::vector<double>& sorted, std::size_t per_mille);

}  // namespace hil
