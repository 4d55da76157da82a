#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace test_support {

/// Mean and variance by Welford's recurrence.
class Moments {
 public:
  void add(double x) {
    ++count_;
    const double off = x - mean_;
    mean_ += off / static_cast<double>(count_);
    sum2_ += off * (x - mean_);
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double variance() const { return sum2_ / static_cast<double>(count_ - 1); }
  [[nodiscard]] double sigma_of_mean() const {
    return std::sqrt(variance() / static_cast<double>(count_));
  }

 private:
  std::size_t count_ = 0;
  double mean_ = 0;
  double sum2_ = 0;
};

/// The chance that a chi-squared of `degrees` degrees of freedom is larger: Q(k/2, x/2), by series
/// or Lentz's continued fraction (Press et al. 1992, Numerical Recipes, section 6.2).
[[nodiscard]] inline double chi_squared_tail(double chi2, std::size_t degrees) {
  const double a = 0.5 * static_cast<double>(degrees);
  const double x = 0.5 * chi2;
  if (x <= 0.0) return 1.0;
  int sign = 1;
  const double front = std::exp(a * std::log(x) - x - ::lgamma_r(a, &sign));
  if (x < a + 1.0) {
    double term = 1.0 / a;
    double sum = term;
    for (int n = 1; n < 10000 && term > 1e-16 * sum; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return 1.0 - front * sum;
  }
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double h = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = an * d + b;
    d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
    c = b + an / c;
    c = std::abs(c) < kTiny ? kTiny : c;
    h *= d * c;
    if (std::abs(d * c - 1.0) < 1e-15) break;
  }
  return front * h;
}

/// The chance of a histogram at least this far from what is expected (Pearson). Neighbouring bins
/// are put together until each expects ten; what no bin expects must not occur.
[[nodiscard]] inline double histogram_p(std::span<const double> observed,
                                        std::span<const double> expected) {
  std::vector<double> o(1, 0.0);
  std::vector<double> e(1, 0.0);
  for (std::size_t i = 0; i < observed.size(); ++i) {
    o.back() += observed[i];
    e.back() += expected[i];
    if (e.back() >= 10.0) {
      o.push_back(0.0);
      e.push_back(0.0);
    }
  }
  if (e.size() > 1) {  // the rest joins the last whole bin
    o[o.size() - 2] += o.back();
    e[e.size() - 2] += e.back();
    o.pop_back();
    e.pop_back();
  }
  double chi2 = 0;
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (e[i] <= 0.0 && o[i] > 0.0) return 0.0;
    if (e[i] > 0.0) chi2 += (o[i] - e[i]) * (o[i] - e[i]) / e[i];
  }
  if (o.size() < 2) return chi2 < 1e-6 ? 1.0 : 0.0;
  return chi_squared_tail(chi2, o.size() - 1);
}

/// Pearson's correlation of a with b.
[[nodiscard]] inline double correlation(std::span<const double> a, std::span<const double> b) {
  Moments ma;
  Moments mb;
  for (const double x : a) ma.add(x);
  for (const double x : b) mb.add(x);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - ma.mean()) * (b[i] - mb.mean());
  return sum / static_cast<double>(a.size() - 1) / std::sqrt(ma.variance() * mb.variance());
}

}  // namespace test_support
