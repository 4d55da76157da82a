#include "tools/characterize/line_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "engine/core/contract.h"

namespace characterize {

Quantity root_of(const Quantity& variance) noexcept {
  const double root = std::sqrt(std::max(variance.value, 0.0));
  const double largest = std::sqrt(variance.error);
  return {root, root > 0.0 ? std::min(variance.error / (2.0 * root), largest) : largest};
}

Quantity ratio_of(const Quantity& a, const Quantity& b) noexcept {
  const double ratio = a.value / b.value;
  return {ratio, std::hypot(a.error, ratio * b.error) / std::abs(b.value)};
}

Line fit_line(std::span<const double> x, std::span<const double> y, std::span<const double> sigma) {
  ENSURE(x.size() == y.size() && x.size() == sigma.size() && x.size() >= 2);
  double sum = 0;
  double sum_x = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double weight = 1.0 / (sigma[i] * sigma[i]);
    sum += weight;
    sum_x += weight * x[i];
  }
  // About the weighted middle, where both coefficients are independent.
  const double middle = sum_x / sum;
  double sum_tt = 0;
  double slope = 0;
  double mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double weight = 1.0 / (sigma[i] * sigma[i]);
    sum_tt += weight * (x[i] - middle) * (x[i] - middle);
    slope += weight * (x[i] - middle) * y[i];
    mean_y += weight * y[i];
  }
  ENSURE(sum_tt > 0.0);
  slope /= sum_tt;
  mean_y /= sum;
  const double slope_error = std::sqrt(1.0 / sum_tt);
  return {{mean_y - slope * middle, std::hypot(std::sqrt(1.0 / sum), slope_error * middle)},
          {slope, slope_error}};
}

}  // namespace characterize
