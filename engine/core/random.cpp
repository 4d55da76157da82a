#include "engine/core/random.h"

#include <algorithm>

namespace engine {
namespace {

// Above this mean a rounded normal differs from Poisson by a total variation of .126/sqrt(mean),
// 4e-6 here: no sensor tells it, and lgamma loses digits there.
constexpr double kNormalLimit = 1e9;
// From here on a double cannot hold the noise beside the mean; infinite light comes out as it is.
constexpr double kExactLimit = 1e30;

/// PTRS, transformed rejection with squeeze: Hoermann 1993, DOI 10.1016/0167-6687(93)90997-4.
double by_rejection(Draws& draws, double mean) noexcept {
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double v_r = 0.9277 - 3.6224 / (b - 2.0);
  const double log_mean = std::log(mean);
  for (;;) {
    const double u = draws.uniform_double() - 0.5;
    const double v = draws.uniform_double();
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2.0 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= v_r) return k;
    if (k < 0.0 || (us < 0.013 && v > us)) continue;
    int sign = 1;
    const double log_factorial = ::lgamma_r(k + 1.0, &sign);
    if (std::log(v * inverse_alpha / (a / (us * us) + b)) <= k * log_mean - mean - log_factorial) {
      return k;
    }
  }
}

}  // namespace

double Draws::poisson_from(double uniform, double mean) noexcept {
  double left = uniform;
  double term = std::exp(-mean);
  double count = 0;
  while (left > term && count < 200.0) {
    left -= term;
    count += 1.0;
    term *= mean / count;
  }
  return count;
}

double Draws::poisson(double mean) noexcept {
  if (!(mean > 0.0)) return 0.0;
  if (mean > kExactLimit) return mean;
  // 53 bits, not 24: at a mean of 1e-6 a coarse uniform would lose the tail altogether.
  if (mean < kInversionLimit) return poisson_from(uniform_double(), mean);
  if (mean < kNormalLimit) return by_rejection(*this, mean);
  return std::max(0.0, std::round(mean + std::sqrt(mean) * static_cast<double>(normal())));
}

}  // namespace engine
