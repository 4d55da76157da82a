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

ConfigReader orbit_text(const std::string& changed) {
  return ConfigReader::from_text(
      "[o]\nsemi_major_axis_km = 7000\neccentricity = 0.01\ninclination_deg = 10\n"
      "argument_of_perigee_deg = 1\nraan_deg = 2\nmean_anomaly_deg = 3\n" +
          changed,
      "x.toml");
}

TEST(ReadElements, TakesDegreesAndKilometres) {
  const ConfigReader config = orbit_text("");
  const KeplerElements read = read_elements(config.table("o"));
  EXPECT_DOUBLE_EQ(read.semi_major_axis_m, 7e6);
  EXPECT_DOUBLE_EQ(read.inclination_rad, 10.0 * kDegree);
  EXPECT_DOUBLE_EQ(read.mean_anomaly_rad, 3.0 * kDegree);
}

TEST(ReadElements, RefusesWhatIsNoEllipseAboutTheEarth) {
  const auto refuses = [](const std::string& assignment) {
    ConfigReader config = orbit_text("");
    config.set(assignment);
    EXPECT_THROW(static_cast<void>(read_elements(config.table("o"))), ConfigError) << assignment;
  };
  refuses("o.eccentricity=1.0");
  refuses("o.eccentricity=-0.1");
  refuses("o.eccentricity=0.5");  // perigee inside the Earth
  refuses("o.semi_major_axis_km=-7000");
  refuses("o.semi_major_axis_km=7000000000000000000000e300");
  refuses("o.semi_major_axis_km=nan");
  refuses("o.inclination_deg=181");
  refuses("o.mean_anomaly_deg=\"3\"");
}

}  // namespace
}  // namespace engine
