#include "engine/orbit/kepler.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::Csv;

/// E - sin E without cancellation, in extended precision.
long double e_minus_sin(long double x) {
  if (x > 0.5L) return x - std::sin(x);
  long double term = x * x * x / 6.0L;
  long double sum = term;
  for (int n = 4; n <= 30; n += 2) {
    term *= -x * x / (static_cast<long double>(n) * (n + 1));
    sum += term;
  }
  return sum;
}

/// Bisection in extended precision: slow, and right. Pre: 0 <= m <= pi.
long double bisected(double e, double m) {
  long double low = m;
  long double high = static_cast<long double>(m) + e;
  const long double e_long = e;
  for (int i = 0; i < 200 && low < high; ++i) {
    const long double middle = 0.5L * (low + high);
    if (middle <= low || middle >= high) break;
    const long double f = (1.0L - e_long) * middle + e_long * e_minus_sin(middle) - m;
    (f > 0.0L ? high : low) = middle;
  }
  return 0.5L * (low + high);
}

constexpr std::array<double, 13> kEccentricities{
    0, 6e-4, 0.0067, 0.1, 0.5, 0.9, 0.99, 0.995, 0.999, 1 - 1e-6, 1 - 1e-8, 1 - 1e-10, 1 - 1e-12};

/// Half evenly over (0, pi], half evenly in the logarithm from 1e-12 on.
std::vector<double> mean_anomalies() {
  constexpr int kHalf = 2000;
  std::vector<double> all;
  for (int i = 1; i <= kHalf; ++i) all.push_back(kPi * i / kHalf);
  for (int i = 0; i < kHalf; ++i) all.push_back(std::pow(10.0, -12.0 + 12.4 * i / kHalf));
  return all;
}

TEST(SolveKepler, AgreesWithBisectionFromTheCircleToTheParabola) {
  for (const double e : kEccentricities) {
    for (const double m : mean_anomalies()) {
      const double found = solve_kepler(e, m).rad;
      const auto truth = static_cast<double>(bisected(e, m));
      // The header's promise: some 200 roundings.
      ASSERT_NEAR(found / truth, 1.0, 5e-14) << "e " << e << " M " << m;
    }
  }
}

TEST(SolveKepler, TakesAtMostFiveIterations) {
  for (const double e : kEccentricities)
    for (const double m : mean_anomalies())
      ASSERT_LE(solve_kepler(e, m).iterations, 5) << "e " << e << " M " << m;
}

TEST(SolveKepler, ReproducesRootsOf40DigitBisection) {
  struct Golden {
    double e;
    double m;
    double rad;
  };
  // The inputs are the nearest doubles; where the roots were printed to 18 digits.
  constexpr std::array<Golden, 6> kGolden{{{0.995, 0.4, 1.37622498603299802},
                                           {0.999, -0.3, -1.24712657224246204},
                                           {0.1, 0.991, 1.07915596763909891},
                                           {1 - 1e-12, 1e-9, 0.00181711959221444907},
                                           {0.9999, 1e-6, 0.00884630818018054882},
                                           {0.0006096, 0.128742467, 0.128820779131278406}}};
  for (const Golden& g : kGolden)
    EXPECT_NEAR(solve_kepler(g.e, g.m).rad / g.rad, 1.0, 5e-14) << "e " << g.e << " M " << g.m;
}

TEST(SolveKepler, IsOddToTheBit) {
  const std::array<double, 6> hard{0.0, kPi,   2.0 * kPi, std::nextafter(2.0 * kPi, 0.0),
                                   1e9, 1e-300};
  for (const double e : kEccentricities) {
    for (const double m : hard) EXPECT_EQ(solve_kepler(e, -m).rad, -solve_kepler(e, m).rad) << m;
    for (const double m : mean_anomalies())
      ASSERT_EQ(solve_kepler(e, -m).rad, -solve_kepler(e, m).rad) << "e " << e << " M " << m;
  }
}

TEST(SolveKepler, StaysInTheTurnForAnyFiniteMeanAnomaly) {
  for (const double e : kEccentricities) {
    for (const double m : {0.0, -0.0, kPi, -kPi, 1e9, -1e9, 1e15, 3e300, 5e-324}) {
      const EccentricAnomaly found = solve_kepler(e, m);
      ASSERT_LE(std::abs(found.rad), kPi) << "e " << e << " M " << m;
      ASSERT_LE(found.iterations, kMostKeplerIterations);
    }
  }
  EXPECT_EQ(solve_kepler(0.5, 0.0).rad, 0.0);
  EXPECT_EQ(solve_kepler(0.5, kPi).rad, kPi);
}

TEST(SolveKepler, SaysWhetherItConverged) {
  for (const double e : kEccentricities)
    for (const double m : mean_anomalies())
      ASSERT_TRUE(solve_kepler(e, m).converged) << "e " << e << " M " << m;
  for (const double m : {0.0, -0.0, kPi, 1e9}) EXPECT_TRUE(solve_kepler(0.5, m).converged) << m;
  for (const double m : {std::nan(""), HUGE_VAL}) {
    EXPECT_FALSE(solve_kepler(0.5, m).converged) << m;
    EXPECT_FALSE(solve_hyperbolic_kepler(1.5, m).converged) << m;
  }
}

/// The same for M = e sinh H - H, without the cancellation near the parabola. Pre: m > 0.
long double bisected_hyperbola(double e, double m) {
  const auto rest = [](long double x) {
    if (x > 0.5L) return std::sinh(x) - x;
    long double term = x * x * x / 6.0L;
    long double sum = term;
    for (int n = 4; n <= 30; n += 2) {
      term *= x * x / (static_cast<long double>(n) * (n + 1));
      sum += term;
    }
    return sum;
  };
  const long double e_long = e;
  long double low = 0.0L;
  long double high = 1.0L + std::asinh(static_cast<long double>(m) / (e_long - 1.0L));
  for (int i = 0; i < 300 && low < high; ++i) {
    const long double middle = 0.5L * (low + high);
    if (middle <= low || middle >= high) break;
    const long double f = (e_long - 1.0L) * middle + e_long * rest(middle) - m;
    (f > 0.0L ? high : low) = middle;
  }
  return 0.5L * (low + high);
}

constexpr std::array<double, 12> kHyperbolas{
    1 + 1e-12, 1 + 1e-10, 1 + 1e-8, 1.0000001, 1.0001, 1.01, 1.25, 1.5, 3.0, 30.0, 3200.0, 1e6};

std::vector<double> hyperbolic_mean_anomalies() {
  constexpr int kCount = 4000;
  std::vector<double> all;
  for (int i = 0; i < kCount; ++i) all.push_back(std::pow(10.0, -12.0 + 22.0 * i / kCount));
  return all;
}

TEST(SolveHyperbolicKepler, AgreesWithBisectionFromTheParabolaToTheStraightLine) {
  for (const double e : kHyperbolas) {
    for (const double m : hyperbolic_mean_anomalies()) {
      const EccentricAnomaly found = solve_hyperbolic_kepler(e, m);
      const auto truth = static_cast<double>(bisected_hyperbola(e, m));
      ASSERT_NEAR(found.rad / truth, 1.0, 1e-13) << "e " << e << " M " << m;
      ASSERT_LE(found.iterations, 6) << "e " << e << " M " << m;
      ASSERT_TRUE(found.converged);
      ASSERT_EQ(solve_hyperbolic_kepler(e, -m).rad, -found.rad);
    }
  }
}

TEST(SolveHyperbolicKepler, ReproducesRootsOf60DigitBisection) {
  // The inputs are the nearest doubles: near the parabola those of the decimals differ by 4e-13.
  const auto h = [](double e, double m) { return solve_hyperbolic_kepler(e, m).rad; };
  EXPECT_NEAR(h(1.0000001, 1e-6) / .0181600991440439817, 1.0, 1e-13);
  EXPECT_NEAR(h(1.5, 3.0) / 1.89945594577961282, 1.0, 1e-13);
  EXPECT_NEAR(h(3200.0, 1e5) / 4.13546379112105858, 1.0, 1e-13);
  EXPECT_NEAR(h(1.0000001, 50.0) / 4.69500299126896722, 1.0, 1e-13);
}

TEST(SolveHyperbolicKepler, HasAnAnswerForAnyFiniteMeanAnomaly) {
  for (const double e : kHyperbolas) {
    EXPECT_EQ(solve_hyperbolic_kepler(e, 0.0).rad, 0.0);
    EXPECT_TRUE(std::signbit(solve_hyperbolic_kepler(e, -0.0).rad));
    for (const double m : {5e-324, 1e-300, 1e9, 1e15, 1e300, 1.7e308}) {
      const EccentricAnomaly found = solve_hyperbolic_kepler(e, m);
      EXPECT_TRUE(std::isfinite(found.rad) && found.rad >= 0.0 && found.converged) << e << " " << m;
    }
  }
}

TEST(MeanAnomaly, IsKeplersEquationReadTheOtherWay) {
  for (const double m : mean_anomalies()) {
    for (const double e : kEccentricities)
      ASSERT_NEAR(mean_anomaly_rad(e, solve_kepler(e, m).rad) / m, 1.0, 2e-13) << e << " " << m;
    for (const double e : kHyperbolas)
      ASSERT_NEAR(mean_anomaly_rad(e, solve_hyperbolic_kepler(e, m).rad) / m, 1.0, 4e-13)
          << e << " " << m;
  }
}

TEST(KeplerPropagator, AgreesWithThe25DigitReference) {
  const test_support::Flyby flyby;
  const Csv reference("orbits_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const double t_s = row.number("t_s");
    const Propagator& body =
        row.text("body") == "camera" ? static_cast<const Propagator&>(flyby.camera) : flyby.target;
    const OrbitState state = body.at(flyby.at(t_s));
    const Eigen::Vector3d place_m =
        1e3 * Eigen::Vector3d(row.number("x_km"), row.number("y_km"), row.number("z_km"));
    const Eigen::Vector3d speed_m_s =
        1e3 * Eigen::Vector3d(row.number("vx_km_s"), row.number("vy_km_s"), row.number("vz_km_s"));
    // The model's requirement; a phase error turns the velocity at twice the mean motion at most.
    const double limit_m = t_s <= 86400.0 ? 1e-5 : 1e-4;
    EXPECT_LT((state.position.m - place_m).norm(), limit_m) << row.text("body") << " " << t_s;
    EXPECT_LT((state.velocity.m_s - speed_m_s).norm(), limit_m * 2.2e-3)
        << row.text("body") << " " << t_s;
  }
}

TEST(KeplerPropagator, ReturnsToItsPlaceAfterWholePeriods) {
  const test_support::Flyby flyby;
  const double a_m = test_support::camera_orbit().semi_major_axis_m;
  const double period_s = 2.0 * kPi * std::sqrt(a_m * a_m * a_m / kEarthMu_m3_s2);
  const Eigen::Vector3d start_m = flyby.camera.at(flyby.epoch).position.m;
  for (const double k : {1.0, 10.0, 1e3, 1e5}) {
    const Eigen::Vector3d later_m = flyby.camera.at(flyby.at(k * period_s)).position.m;
    // Half a nanosecond of the clock, and five roundings of the phase: n, t, n t, M, the turn.
    const double limit_m = 0.5e-9 * 7.7e3 + 5.0 * 0x1p-53 * 2.0 * kPi * k * a_m;
    EXPECT_LT((later_m - start_m).norm(), limit_m) << k << " periods";
  }
}

TEST(KeplerPropagator, KeepsEnergyAndAngularMomentum) {
  const test_support::Flyby flyby;
  const auto energy = [](const OrbitState& s) {
    return 0.5 * s.velocity.m_s.squaredNorm() - kEarthMu_m3_s2 / s.position.m.norm();
  };
  const OrbitState first = flyby.camera.at(flyby.epoch);
  const Eigen::Vector3d spin = first.position.m.cross(first.velocity.m_s);
  for (int i = 1; i <= 1000; ++i) {
    const OrbitState later = flyby.camera.at(flyby.at(1296.0 * i));
    // Twenty roundings or so.
    ASSERT_NEAR(energy(later) / energy(first), 1.0, 1e-14) << i;
    ASSERT_LT((later.position.m.cross(later.velocity.m_s) - spin).norm() / spin.norm(), 1e-14) << i;
  }
}

TEST(KeplerPropagator, GoesBackTheWayItCame) {
  const Epoch epoch = test_support::epoch_2022();
  for (const double e : {0.0, 1e-16, 1e-8, 0.3}) {
    for (const double i_deg : {0.0, 1e-12, 90.0, 180.0}) {
      const KeplerPropagator orbit({9e6, e, i_deg * kDegree, 0.0, 0.0, 0.0}, epoch);
      const OrbitState ahead = orbit.at(epoch + from_seconds(1000.0));
      const OrbitState behind = orbit.at(epoch - from_seconds(1000.0));
      // Mirror images in the line of apsides, x here.
      EXPECT_NEAR(ahead.position.m.x(), behind.position.m.x(), 1e-8) << e << " " << i_deg;
      EXPECT_LT((ahead.position.m.tail<2>() + behind.position.m.tail<2>()).norm(), 1e-8);
      EXPECT_TRUE(ahead.velocity.m_s.allFinite());
    }
  }
}

TEST(KeplerPropagator, FollowsAHyperbolaThatKeepsEnergyAndAngularMomentum) {
  const Epoch epoch = test_support::epoch_2022();
  for (const double e : {1.0001, 1.2, 5.0}) {
    const double a_m = -7e6 / (e - 1.0);
    const KeplerPropagator orbit({a_m, e, 1.0, 0.3, 2.0, 0.0}, epoch);
    const OrbitState perigee = orbit.at(epoch);
    EXPECT_NEAR(perigee.position.m.norm(), 7e6, 1e-6);
    const Eigen::Vector3d spin = perigee.position.m.cross(perigee.velocity.m_s);
    for (double t_s = -1e5; t_s <= 1e5; t_s += 3e3) {
      const OrbitState s = orbit.at(epoch + from_seconds(t_s));
      const double r_m = s.position.m.norm();
      const double energy = 0.5 * s.velocity.m_s.squaredNorm() - kEarthMu_m3_s2 / r_m;
      // Against what cancels in them; near the parabola the place itself is a small difference of
      // parts as long as the axis.
      const double rounding = 4e-15 + 4.0 * 0x1p-53 * std::abs(a_m) / r_m;
      const double parts = 0.5 * s.velocity.m_s.squaredNorm() + kEarthMu_m3_s2 / r_m;
      EXPECT_LT(std::abs(energy + 0.5 * kEarthMu_m3_s2 / a_m), rounding * parts) << e;
      EXPECT_LT((s.position.m.cross(s.velocity.m_s) - spin).norm(),
                rounding * r_m * s.velocity.m_s.norm())
          << e;
      // The velocity is how the place changes: third differences of a second leave 1e-5 m/s.
      const Eigen::Vector3d moved = orbit.at(epoch + from_seconds(t_s + 0.5)).position.m -
                                    orbit.at(epoch + from_seconds(t_s - 0.5)).position.m;
      EXPECT_LT((moved - s.velocity.m_s).norm(), 1e-3) << e << " " << t_s;
    }
  }
}

TEST(KeplerPropagator, IsNeverFasterThanItsBoundAndReachesIt) {
  const Epoch epoch = test_support::epoch_2022();
  for (const double e : {0.0, 0.0067, 0.7, 1.0001, 3.0}) {
    const KeplerPropagator orbit({7e6 / (1.0 - e), e, 1.0, 0.3, 2.0, 0.0}, epoch);
    const double bound = orbit.speed_bound_m_s();
    for (double t_s = -6e3; t_s <= 6e3; t_s += 100.0)
      EXPECT_LE(orbit.at(epoch + from_seconds(t_s)).velocity.m_s.norm(), bound) << e << " " << t_s;
    EXPECT_NEAR(orbit.at(epoch).velocity.m_s.norm() / bound, 1.0, 1e-8) << e;
  }
}

}  // namespace
}  // namespace engine
