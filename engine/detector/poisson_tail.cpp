#include "engine/detector/poisson_tail.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

constexpr double kLargestSummed = 2e6;

/// The w > 0 beyond which a normal distribution has the share q <= 1/2, to 4.5e-4: Abramowitz and
/// Stegun 1964, 26.2.23.
double normal_quantile(double q) noexcept {
  const double t = std::sqrt(-2.0 * std::log(q));
  return t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                 (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
}

double probability(double k, double mean) noexcept {
  int sign = 1;
  return std::exp(k * std::log(mean) - mean - ::lgamma_r(k + 1.0, &sign));
}

/// P(X <= k), where it is small or the terms fall.
double share_up_to(double k, double mean) noexcept {
  double term = probability(k, mean);
  double sum = term;
  for (double j = k; j > 0.0 && term > 1e-17 * sum; j -= 1.0) {
    term *= j / mean;
    sum += term;
  }
  return sum;
}

/// P(X > k) for k + 2 > mean.
double share_above(double k, double mean) noexcept {
  double term = probability(k + 1.0, mean);
  double sum = term;
  for (double j = k + 2.0; term > 1e-17 * sum; j += 1.0) {
    term *= mean / j;
    sum += term;
  }
  return sum;
}

/// The least k with P(X <= k) >= share.
double from_below(double share, double guess, double mean) noexcept {
  double k = std::max(0.0, guess);
  double sum = share_up_to(k, mean);
  double term = probability(k, mean);
  while (k > 0.0 && sum - term >= share) {
    sum -= term;
    term *= k / mean;
    k -= 1.0;
  }
  while (sum < share) {
    k += 1.0;
    term *= mean / k;
    sum += term;
  }
  return k;
}

/// The least k with P(X > k) <= share.
double from_above(double share, double guess, double mean) noexcept {
  double k = std::max(std::ceil(mean), guess);
  double sum = share_above(k, mean);
  double term = probability(k, mean);
  while (k > 0.0 && sum + term <= share) {
    sum += term;
    term *= k / mean;
    k -= 1.0;
  }
  while (sum > share) {
    k += 1.0;
    term *= mean / k;
    sum -= term;
  }
  return k;
}

}  // namespace

double poisson_tail(std::uint32_t word, double detail, double mean) noexcept {
  const bool low = word < 0x80000000U;
  const double share =
      (low ? static_cast<double>(word) + detail : static_cast<double>(~word) + (1.0 - detail)) *
      0x1p-32;
  const double w = low ? -normal_quantile(share) : normal_quantile(share);
  const double guess = std::floor(mean + std::sqrt(mean) * w + (w * w + 2.0) / 6.0);
  if (mean > kLargestSummed) return std::max(0.0, guess);
  return low ? from_below(share, guess, mean) : from_above(share, guess, mean);
}

}  // namespace engine
