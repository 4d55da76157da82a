#pragma once

#include <span>

namespace characterize {

/// A measured value and its standard error, in the same unit.
struct Quantity {
  double value = 0;
  double error = 0;
};

/// The root of a variance that may have come out negative: then it is 0, and its error is what a
/// variance of one standard error would be the root of.
[[nodiscard]] Quantity root_of(const Quantity& variance) noexcept;
/// a / b, their errors independent and small.
[[nodiscard]] Quantity ratio_of(const Quantity& a, const Quantity& b) noexcept;

/// intercept + slope x.
struct Line {
  Quantity intercept;
  Quantity slope;
  [[nodiscard]] double at(double x) const noexcept { return intercept.value + slope.value * x; }
};

/// Least squares, weighted by 1 / sigma^2, the errors of y (Press et al. 1992, Numerical Recipes,
/// section 15.2). Pre: all of one length, two different x at least, sigma > 0.
[[nodiscard]] Line fit_line(std::span<const double> x, std::span<const double> y,
                            std::span<const double> sigma);

}  // namespace characterize
