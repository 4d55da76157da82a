#include "engine/orbit/j2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/orbit/elements.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;

constexpr double kDay_s = 86400.0;

/// One of the paper's satellites over an oblate Earth, for 15 days.
J2Propagator oblate(const KeplerElements& elements, double days = 15.0,
                    const OblateEarth& earth = {}) {
  const Epoch epoch = test_support::epoch_2022();
  return {KeplerPropagator(elements, epoch).at(epoch),
          epoch,
          {epoch, epoch + from_seconds(days * kDay_s)},
          earth};
}

TEST(J2Propagator, KeepsEnergyAndThePolarAngularMomentum) {
  const Flyby flyby;
  for (const KeplerElements& elements : {test_support::camera_orbit(), test_support::target_orbit(),
                                         KeplerElements{26.6e6, 0.72, 1.1, 4.7, 0.3, 1.0}}) {
    const J2Propagator body = oblate(elements);
    const OrbitState first = body.at(flyby.epoch);
    const double spin = first.position.m.cross(first.velocity.m_s).z();
    for (int i = 1; i <= 3000; ++i) {
      const OrbitState later = body.at(flyby.at(432.0 * i));
      // Two thousand steps of a few roundings each, at random.
      ASSERT_NEAR(energy_j_kg(later) / energy_j_kg(first), 1.0, 1e-13) << i;
      ASSERT_NEAR(later.position.m.cross(later.velocity.m_s).z() / spin, 1.0, 1e-13) << i;
    }
  }
}

TEST(J2Propagator, IsTwoBodyMotionWhereTheEarthIsRound) {
  const Flyby flyby;
  OblateEarth round;
  round.j2 = 0.0;
  for (const bool camera : {true, false}) {
    const KeplerElements elements =
        camera ? test_support::camera_orbit() : test_support::target_orbit();
    const J2Propagator body = oblate(elements, 15.0, round);
    const KeplerPropagator exact(elements, flyby.epoch);
    for (int i = 0; i <= 3000; ++i) {
      const Epoch t = flyby.at(432.0 * i);
      // Roundings of 1e-16 of the axis in each of 2000 steps, at random, after 1450 rad.
      ASSERT_LT((body.at(t).position.m - exact.at(t).position.m).norm(), 1e-3) << i;
      ASSERT_LT((body.at(t).velocity.m_s - exact.at(t).velocity.m_s).norm(), 1e-6) << i;
    }
  }
}

/// An independent integration: Runge and Kutta's fourth order, in small steps.
OrbitState by_runge_kutta(OrbitState s, double t_s, int steps) {
  const OblateEarth earth;
  const auto pull = [&](const Vector3d& r) {
    const double d = r.norm();
    const double k = 1.5 * earth.j2 * std::pow(earth.radius_m / d, 2);
    const double sine2 = std::pow(r.z() / d, 2);
    const Vector3d shape(1.0 + k * (1.0 - 5.0 * sine2), 1.0 + k * (1.0 - 5.0 * sine2),
                         1.0 + k * (3.0 - 5.0 * sine2));
    return Vector3d(-earth.mu_m3_s2 / (d * d * d) * r.cwiseProduct(shape));
  };
  const double h = t_s / steps;
  for (int i = 0; i < steps; ++i) {
    const Vector3d r = s.position.m;
    const Vector3d v = s.velocity.m_s;
    const Vector3d a1 = pull(r);
    const Vector3d a2 = pull(r + 0.5 * h * v);
    const Vector3d a3 = pull(r + 0.5 * h * v + 0.25 * h * h * a1);
    const Vector3d a4 = pull(r + h * v + 0.5 * h * h * a2);
    s.position.m += h * v + h * h / 6.0 * (a1 + a2 + a3);
    s.velocity.m_s += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  return s;
}

TEST(J2Propagator, AgreesWithAnotherIntegratorForwardsAndBackwards) {
  const Flyby flyby;
  const OrbitState start = flyby.target.at(flyby.epoch);
  const J2Propagator body(start, flyby.epoch, {flyby.at(-6000.0), flyby.at(6000.0)});
  for (const double t_s : {-6000.0, -2400.0, -1.0, 0.0, 1.0, 1800.0, 6000.0}) {
    // (n h)^4 / 120 of the axis for each radian, at .2 s: 5e-8 m; and the roundings of 30000 steps.
    const OrbitState slow = by_runge_kutta(start, t_s, 30000);
    EXPECT_LT((body.at(flyby.at(t_s)).position.m - slow.position.m).norm(), 2e-6) << t_s;
    EXPECT_LT((body.at(flyby.at(t_s)).velocity.m_s - slow.velocity.m_s).norm(), 2e-9) << t_s;
  }
}

TEST(J2Propagator, ItsVelocityIsHowItsPlaceMovesAcrossTheStepsToo) {
  const Flyby flyby;
  const J2Propagator body = oblate(test_support::camera_orbit(), 0.2);
  for (double t_s = 1.0; t_s < 17000.0; t_s += 7.0) {
    const Vector3d moved =
        body.at(flyby.at(t_s + 0.5)).position.m - body.at(flyby.at(t_s - 0.5)).position.m;
    // The third derivative, n^3 a / 24, and a metre's rounding.
    ASSERT_LT((moved - body.at(flyby.at(t_s)).velocity.m_s).norm(), 5e-4) << t_s;
  }
}

TEST(J2Propagator, LeavesTwoBodyMotionAsFastAsTheBulgeAsks) {
  struct Row {
    double t_s;
    double camera_km;
    double target_km;
    double digit_km;  ///< half of the last digit that is printed
  };
  // Computed independently for this project with an eighth-order Runge-Kutta method.
  constexpr std::array<Row, 6> kTable{{{600.0, 1.56, 1.81, 0.005},
                                       {5400.0, 32.5, 15.5, 0.05},
                                       {21600.0, 124.0, 42.0, 0.5},
                                       {86400.0, 488.0, 293.0, 0.5},
                                       {3 * 86400.0, 1497.0, 837.0, 0.5},
                                       {15 * 86400.0, 7186.0, 2899.0, 0.5}}};
  const Flyby flyby;
  const J2Propagator camera = oblate(test_support::camera_orbit());
  const J2Propagator target = oblate(test_support::target_orbit());
  for (const Row& row : kTable) {
    const Epoch t = flyby.at(row.t_s);
    const auto off_km = [&](const Propagator& a, const Propagator& b) {
      return 1e-3 * (a.at(t).position.m - b.at(t).position.m).norm();
    };
    EXPECT_NEAR(off_km(camera, flyby.camera), row.camera_km, row.digit_km) << row.t_s;
    EXPECT_NEAR(off_km(target, flyby.target), row.target_km, row.digit_km) << row.t_s;
  }
}

TEST(J2Propagator, HasFifteenPassesUnder300KilometresIn15Days) {
  const Flyby flyby;
  const J2Propagator camera = oblate(test_support::camera_orbit());
  const J2Propagator target = oblate(test_support::target_orbit());
  const auto range_m = [&](double t_s) {
    const Epoch t = flyby.at(t_s);
    return (camera.at(t).position.m - target.at(t).position.m).norm();
  };
  // Half an orbit lies between two minima, and 60 s about one are a parabola to be searched.
  constexpr double kStep_s = 60.0;
  std::vector<std::pair<double, double>> passes;  // s, m
  for (double t_s = kStep_s; t_s < 15.0 * kDay_s - kStep_s; t_s += kStep_s) {
    if (range_m(t_s) > range_m(t_s - kStep_s) || range_m(t_s) > range_m(t_s + kStep_s)) continue;
    double low = t_s - kStep_s;
    double high = t_s + kStep_s;
    for (int i = 0; i < 60; ++i) {
      const double third = (high - low) / 3.0;
      if (range_m(low + third) < range_m(high - third)) {
        high -= third;
      } else {
        low += third;
      }
    }
    if (range_m(low) < 300e3) passes.emplace_back(low, range_m(low));
  }
  // Computed independently for this project: 15, the first after 98.58 h, the closest 39.4 km.
  ASSERT_EQ(passes.size(), 15U);
  EXPECT_NEAR(passes[0].first / 3600.0, 98.58, 0.01);  // its middle, 20 s after its start at most
  const auto closest =
      std::min_element(passes.begin(), passes.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  EXPECT_NEAR(closest->second, 39.4e3, 50.0);
}

struct Rates {
  double node_deg_day = 0;
  double perigee_deg_day = 0;
};

/// Of node and perigee from one revolution's mean to another's, five days later.
Rates secular_rates(const KeplerElements& elements) {
  const Flyby flyby;
  const J2Propagator body = oblate(elements, 6.0);
  const double period_s =
      2.0 * kPi * std::sqrt(std::pow(elements.semi_major_axis_m, 3) / kEarthMu_m3_s2);
  double node[2] = {};
  Eigen::Vector2d perigee[2] = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  constexpr int kSamples = 360;
  for (int day : {0, 1}) {
    for (int i = 0; i < kSamples; ++i) {
      const Epoch t = flyby.at(5.0 * kDay_s * day + period_s * i / kSamples);
      const KeplerElements now = elements_of(body.at(t)).value();
      node[day] += std::remainder(now.raan_rad - elements.raan_rad, 2.0 * kPi) / kSamples;
      perigee[day] += now.eccentricity * Eigen::Vector2d(std::cos(now.argument_of_perigee_rad),
                                                         std::sin(now.argument_of_perigee_rad));
    }
  }
  const double turned =
      std::atan2(perigee[0].x() * perigee[1].y() - perigee[0].y() * perigee[1].x(),
                 perigee[0].dot(perigee[1]));
  return {(node[1] - node[0]) / kDegree / 5.0, turned / kDegree / 5.0};
}

TEST(J2Propagator, TurnsNodeAndPerigeeAtTheirSecularRates) {
  // Kaula 1966: -3/2 n J2 (R/p)^2 cos i and 3/4 n J2 (R/p)^2 (5 cos^2 i - 1).
  const Rates camera = secular_rates(test_support::camera_orbit());
  EXPECT_NEAR(camera.node_deg_day, 0.992, 0.00992);
  EXPECT_NEAR(camera.perigee_deg_day, -3.524, 0.03524);
  const Rates target = secular_rates(test_support::target_orbit());
  EXPECT_NEAR(target.node_deg_day, -4.950, 0.0495);
  EXPECT_NEAR(target.perigee_deg_day, 3.691, 0.03691);
}

TEST(J2Propagator, IsNeverFasterThanItsBoundAndNotMuchSlower) {
  for (const double e : {0.0067, 0.72}) {
    const Flyby flyby;
    const J2Propagator body = oblate({7e6 / (1.0 - e), e, 1.0, 0.3, 2.0, 3.0}, 1.0);
    double fastest = 0;
    for (int i = 0; i <= 86400; ++i)
      fastest = std::max(fastest, body.at(flyby.at(i)).velocity.m_s.norm());
    EXPECT_LE(fastest, body.speed_bound_m_s());
    EXPECT_GT(fastest, 0.97 * body.speed_bound_m_s());
  }
}

TEST(J2Propagator, StandsStillBeyondItsSpan) {
  const Flyby flyby;
  const J2Propagator body = oblate(test_support::camera_orbit(), 0.1);
  const EpochSpan span = body.span();
  EXPECT_EQ(span.begin, flyby.epoch);
  EXPECT_EQ(body.at(Epoch::min()).position.m, body.at(span.begin).position.m);
  EXPECT_EQ(body.at(Epoch::max()).position.m, body.at(span.end).position.m);
}

TEST(J2Propagator, FollowsAHyperbolaAndAnInstant) {
  const Epoch epoch = test_support::epoch_2022();
  const KeplerElements away{-2e7, 1.4, 1.0, 0.3, 2.0, 0.1};
  const J2Propagator body = oblate(away, 10.0);
  const OrbitState end = body.at(body.span().end);
  EXPECT_NEAR(energy_j_kg(end) / energy_j_kg(body.at(epoch)), 1.0, 1e-13);
  EXPECT_GT(end.position.m.norm(), 3e9);
  EXPECT_LT(body.steps(), 200U);
  const OrbitState start = body.at(epoch);
  const J2Propagator instant(start, epoch, {epoch, epoch});
  EXPECT_LT((instant.at(epoch).position.m - start.position.m).norm(), 1e-8);
}

}  // namespace
}  // namespace engine
