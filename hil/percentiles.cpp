#include "hil/percentiles.h"

#include <algorithm>
#include <cmath>

#include "engine/core/contract.h"

namespace hil {

double nearest_rank(const std::vector<double>& sorted, std::size_t per_mille) {
  ENSURE(!sorted.empty() && per_mille >= 1 && per_mille <= 1000);
  // In whole numbers: a share times a count, in doubles, can end up past the rank that it means.
  const std::size_t rank = (sorted.size() * per_mille + 999) / 1000;
  return sorted[rank - 1];
}

Percentiles percentiles_of(std::vector<double> values) {
  std::erase_if(values, [](double x) { return std::isnan(x); });
  Percentiles p;
  p.count = values.size();
  if (values.empty()) return p;
  std::sort(values.begin(), values.end());
  p.p50 = nearest_rank(values, 500);
  p.p99 = nearest_rank(values, 990);
  p.p99_9 = nearest_rank(values, 999);
  p.max = values.back();
  return p;
}

}  // namespace hil
