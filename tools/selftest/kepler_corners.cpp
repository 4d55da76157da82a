// Kepler's equation, where Newton's method leaves its basin and where double precision cancels.

#include <array>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using engine::kPi;
using Long = long double;

constexpr int kMeans = 2000;

/// From 1e-12 to pi, evenly by logarithm.
double mean_anomaly(int i) { return kPi * std::pow(10.0, -12.0 * (1.0 - (i + 1.0) / kMeans)); }

/// E - sin E, or of a hyperbola sinh H - H, without cancellation: the sign of its series' terms is
/// all that differs.
Long less_its_sine(Long x, bool hyperbola) {
  if (std::fabs(x) > 1.0L) return hyperbola ? std::sinh(x) - x : x - std::sin(x);
  const Long square = hyperbola ? x * x : -x * x;
  Long term = x * x * x / 6.0L;
  Long sum = term;
  for (int k = 4; k < 40; k += 2) {
    term *= square / static_cast<Long>(k * (k + 1));
    sum += term;
  }
  return sum;
}

/// How far an answer is from the root, relative: a Newton's step from there in 64 bits of mantissa.
double error_of_answer(double e, double mean, double answer) {
  const bool hyperbola = e > 1.0;
  const Long x = answer;
  const Long off_one = hyperbola ? Long{e} - 1.0L : 1.0L - Long{e};
  const Long got = off_one * x + Long{e} * less_its_sine(x, hyperbola);
  const Long half = hyperbola ? std::sinh(x / 2.0L) : std::sin(x / 2.0L);
  const Long slope = off_one + 2.0L * Long{e} * half * half;
  return static_cast<double>(std::fabs((got - Long{mean}) / (slope * x)));
}

/// Newton's method from E = M, as printed.
double newton(double e, double mean) {
  double anomaly = mean;
  for (int i = 0; i < 50; ++i) {
    const double step = (anomaly - e * std::sin(anomaly) - mean) / (1.0 - e * std::cos(anomaly));
    anomaly -= step;
    if (std::abs(step) < 1e-14) break;
  }
  return anomaly;
}

double hyperbolic_newton(double e, double mean) {
  double anomaly = mean;
  for (int i = 0; i < 50; ++i) {
    const double step = (e * std::sinh(anomaly) - anomaly - mean) / (e * std::cosh(anomaly) - 1.0);
    anomaly -= step;
    if (std::abs(step) < 1e-14) break;
  }
  return anomaly;
}

/// A bracket halved until nothing is left of it: safe, but for E - e sin E itself.
double bisected(double e, double mean) {
  double low = mean;
  double high = mean + e;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (middle - e * std::sin(middle) < mean ? low : high) = middle;
  }
  return low;
}

constexpr double kEllipseBound = 5e-14;
constexpr double kHyperbolaBound = 1e-13;

Corner divergence() {
  Worst plain;
  Worst ours;
  for (const double e : {0.9, 0.99, 0.999, 1.0 - 1e-6, 1.0 - 1e-9, 1.0 - 1e-12}) {
    for (int i = 0; i < kMeans; ++i) {
      const double mean = mean_anomaly(i);
      plain.add(error_of_answer(e, mean, newton(e, mean)));
      ours.add(error_of_answer(e, mean, engine::solve_kepler(e, mean).rad));
    }
  }
  return {"Kepler, e from .9 to 1 - 1e-12",
          "Newton from E = M",
          plain.value(),
          ours.value(),
          kEllipseBound,
          "of E",
          "Error of E, against a residual in extended precision. The bound is some 200 roundings: "
          "the series' terms and three Halley's steps. Charles and Tatum 1998, Celestial Mechanics "
          "69, 357, on where Newton's method diverges."};
}

Corner cancellation() {
  Worst plain;
  Worst ours;
  for (const double e : {1.0 - 1e-8, 1.0 - 1e-10}) {
    for (int i = 0; i < kMeans / 2; ++i) {
      const double mean = mean_anomaly(i);
      plain.add(error_of_answer(e, mean, bisected(e, mean)));
      ours.add(error_of_answer(e, mean, engine::solve_kepler(e, mean).rad));
    }
  }
  return {
      "Kepler, E - e sin E cancels",
      "bisection of the formula",
      plain.value(),
      ours.value(),
      kEllipseBound,
      "of E",
      "Error of E where both terms are alike: the bracket closes on the wrong place. Ours takes "
      "the difference from its series. Farnocchia et al. 2013, DOI 10.1007/s10569-013-9476-9."};
}

int newton_iterations_to(double residual, double e, double mean) {
  double anomaly = mean;
  int n = 0;
  for (; n < 1000; ++n) {
    const double f = anomaly - e * std::sin(anomaly) - mean;
    if (std::abs(f) < residual) break;
    anomaly -= f / (1.0 - e * std::cos(anomaly));
  }
  return n;
}

Corner termination() {
  Worst plain;
  Worst ours;
  for (int i = 0; i < 200; ++i) {
    const double mean = 0.001 + kPi * i / 200.0;
    plain.add(newton_iterations_to(1e-16, 0.1, mean));
    const auto answer = engine::solve_kepler(0.1, mean);
    ours.add(answer.converged ? answer.iterations : HUGE_VAL);
  }
  return {"Kepler, tolerance below rounding",
          "until |f| < 1e-16",
          plain.value(),
          ours.value(),
          5,
          "steps",
          "Iterations at e = .1; the plain loop is ended at 1000. Ours stops by the step against "
          "the rounding of E; five are what its third order needs from any start."};
}

Corner hyperbola() {
  Worst plain;
  Worst ours;
  for (const double e : {1.0 + 1e-7, 1.001, 1.5, 10.0, 3200.0}) {
    for (int i = -40; i <= 60; ++i) {
      const double mean = std::pow(10.0, i / 10.0);
      plain.add(error_of_answer(e, mean, hyperbolic_newton(e, mean)));
      ours.add(error_of_answer(e, mean, engine::solve_hyperbolic_kepler(e, mean).rad));
    }
  }
  return {
      "Kepler, hyperbola, M to 1e6",
      "Newton from H = M",
      plain.value(),
      ours.value(),
      kHyperbolaBound,
      "of H",
      "Error of H: sinh overflows from the plain start. The bound is 450 roundings, of sinh and "
      "of the cubic's root near the parabola. Danby 1988, Fundamentals of Celestial Mechanics, "
      "section 6.9."};
}

}  // namespace

Room kepler_corners() {
  return {"Kepler's equation", {divergence(), cancellation(), termination(), hyperbola()}};
}

}  // namespace corners
