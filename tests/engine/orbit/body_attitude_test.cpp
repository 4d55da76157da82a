#include "engine/orbit/body_attitude.h"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test_support::Flyby;

double energy(const Vector3d& inertia, const Vector3d& rate) {
  return 0.5 * rate.dot(inertia.cwiseProduct(rate));
}
Vector3d momentum(const Vector3d& inertia, const TumblingBody::Turned& body) {
  return body.j2000_from_body * Vector3d(inertia.cwiseProduct(body.rate_rad_s));
}
double angle_between(const Quaterniond& a, const Quaterniond& b) {
  return 2.0 * (a.conjugate() * b).vec().norm();
}
const Quaterniond kSomehow = Quaterniond(0.5, 0.1, -0.7, 0.3).normalized();

TEST(TumblingBody, KeepsEnergyAndAngularMomentumForDays) {
  for (const Vector3d& rate : {Vector3d(0.02, 0.03, 0.1), Vector3d(0.1, 0.02, -0.03),
                               Vector3d(1e-3, 0.1, 1e-3), Vector3d(0.0, 0.1, 1e-6)}) {
    const Vector3d inertia(0.5, 0.8, 1.0);
    const TumblingBody body(inertia, rate, kSomehow);
    const Vector3d start = momentum(inertia, body.at(0.0));
    for (int i = 0; i < 3000; ++i) {
      const TumblingBody::Turned now = body.at(432.7 * i);
      ASSERT_NEAR(energy(inertia, now.rate_rad_s) / energy(inertia, rate), 1.0, 1e-12) << i;
      // Its direction is the attitude's.
      ASSERT_LT((momentum(inertia, now) - start).norm() / start.norm(), 1e-9) << i;
      ASSERT_NEAR(now.j2000_from_body.norm(), 1.0, 1e-14);
    }
  }
}

/// An independent integration: Runge and Kutta's fourth order on the matrix, in small steps.
TumblingBody::Turned by_runge_kutta(const Vector3d& inertia, const Vector3d& rate, double t_s,
                                    int steps) {
  struct State {
    Matrix3d axes;
    Vector3d rate;
  };
  const auto change = [&](const State& s) {
    Matrix3d cross;
    cross << 0, -s.rate.z(), s.rate.y(), s.rate.z(), 0, -s.rate.x(), -s.rate.y(), s.rate.x(), 0;
    const Vector3d spin = inertia.cwiseProduct(s.rate);
    return State{s.axes * cross, spin.cross(s.rate).cwiseQuotient(inertia)};
  };
  const auto add = [](const State& a, const State& b, double h) {
    return State{a.axes + h * b.axes, a.rate + h * b.rate};
  };
  State s{kSomehow.toRotationMatrix(), rate};
  const double h = t_s / steps;
  for (int i = 0; i < steps; ++i) {
    const State k1 = change(s);
    const State k2 = change(add(s, k1, 0.5 * h));
    const State k3 = change(add(s, k2, 0.5 * h));
    const State k4 = change(add(s, k3, h));
    s = add(add(add(add(s, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0);
  }
  return {Quaterniond(s.axes), s.rate};
}

TEST(TumblingBody, AgreesWithAnotherIntegrator) {
  const Vector3d inertia(0.5, 0.8, 1.0);
  for (const Vector3d& rate : {Vector3d(0.02, 0.03, 0.1), Vector3d(0.1, 0.02, -0.03)}) {
    const TumblingBody body(inertia, rate, kSomehow);
    for (const double t_s : {0.0, 1.0, 100.0, 1000.0, -300.0}) {
      const auto slow = by_runge_kutta(inertia, rate, t_s, 20000);
      const auto got = body.at(t_s);
      // (w h)^4 / 120 for each of 100 rad, w h = .005.
      EXPECT_LT((got.rate_rad_s - slow.rate_rad_s).norm(), 1e-9) << t_s;
      EXPECT_LT(angle_between(got.j2000_from_body, slow.j2000_from_body), 1e-8) << t_s;
    }
  }
}

TEST(TumblingBody, HasACycleAfterWhichTheRateIsTheSame) {
  const Vector3d inertia(0.5, 0.8, 1.0);
  for (const Vector3d& rate : {Vector3d(0.02, 0.03, 0.1), Vector3d(0.1, 0.02, -0.03)}) {
    const TumblingBody body(inertia, rate, kSomehow);
    const double almost = body.cycle_s() * (1.0 - 1e-12);
    EXPECT_LT((body.at(almost).rate_rad_s - rate).norm(), 1e-12);
    EXPECT_LT((body.at(1e5 * body.cycle_s() + 1e-6).rate_rad_s - rate).norm(), 1e-8);
    EXPECT_GT((body.at(0.5 * body.cycle_s()).rate_rad_s - rate).norm(), 1e-3);
  }
}

TEST(TumblingBody, FlipsOverFromItsMiddleAxis) {
  // Half a cycle later it turns the other way about the same axis of its own, as wing nuts do.
  const Vector3d inertia(0.5, 0.8, 1.0);
  const TumblingBody body(inertia, Vector3d(1e-4, 0.1, 0.0), kSomehow);
  EXPECT_NEAR(body.at(0.5 * body.cycle_s()).rate_rad_s.y(), -0.1, 1e-6);
  EXPECT_NEAR(body.at(body.cycle_s() * (1 - 1e-9)).rate_rad_s.y(), 0.1, 1e-6);
  // About the largest and the smallest it does not.
  for (const Vector3d& rate : {Vector3d(0.1, 1e-4, 0.0), Vector3d(0.0, 1e-4, 0.1)}) {
    const TumblingBody steady(inertia, rate, kSomehow);
    for (int i = 0; i < 1000; ++i) ASSERT_LT((steady.at(1.7 * i).rate_rad_s - rate).norm(), 1e-3);
  }
}

TEST(TumblingBody, OfASymmetricBodyPrecessesAtTheKnownRate) {
  // Landau & Lifshitz, Mechanics, section 33: the rate turns about the axis by (I3 - I1) / I1 w3.
  const Vector3d inertia(0.6, 0.6, 1.0);
  const Vector3d rate(0.05, 0.0, 0.1);
  const TumblingBody body(inertia, rate, kSomehow);
  const double speed = 0.4 / 0.6 * 0.1;
  EXPECT_NEAR(body.cycle_s() * speed, 2.0 * kPi, 1e-12);
  for (const double t_s : {10.0, 123.0, 1e6}) {
    const Vector3d want(0.05 * std::cos(speed * t_s), 0.05 * std::sin(speed * t_s), 0.1);
    EXPECT_LT((body.at(t_s).rate_rad_s - want).norm(), 1e-10) << t_s;
  }
}

TEST(TumblingBody, TurnsEvenlyWhereNothingPulls) {
  for (const Vector3d& inertia : {Vector3d(1, 1, 1), Vector3d(0.5, 0.8, 1.0)}) {
    const bool ball = inertia.x() == 1.0;
    const Vector3d rate = ball ? Vector3d(0.01, 0.02, 0.03) : Vector3d(0.0, 0.1, 0.0);
    const TumblingBody body(inertia, rate, kSomehow);
    EXPECT_EQ(body.cycle_s(), 0.0);
    const Quaterniond want =
        kSomehow * Quaterniond(Eigen::AngleAxisd(rate.norm() * 7.0, rate.normalized()));
    EXPECT_LT(angle_between(body.at(7.0).j2000_from_body, want), 1e-14);
  }
  const TumblingBody still(Vector3d(0.5, 0.8, 1.0), Vector3d::Zero(), kSomehow);
  EXPECT_EQ(angle_between(still.at(1e6).j2000_from_body, kSomehow), 0.0);
}

TEST(TumblingBody, StartsFromAnyAttitudeHalfTurnsIncluded) {
  // The matrix of a half turn has a trace of -1, where a quaternion by its trace loses all digits.
  for (int i = 0; i < 1000; ++i) {
    const Vector3d axis(std::sin(1.0 * i), std::cos(2.3 * i), std::sin(0.7 * i + 1.0));
    AttitudeSpec spec;
    spec.kind = AttitudeKind::kTumbling;
    spec.rate_rad_s = Vector3d(0.01, 0.02, 0.03);
    spec.body_from_j2000 = Eigen::AngleAxisd(kPi, axis.normalized());
    const BodyAttitude body(spec, Epoch{});
    const Matrix3d want = spec.body_from_j2000->toRotationMatrix();
    ASSERT_LT((body.axes(Epoch{}, {}).matrix - want).cwiseAbs().maxCoeff(), 1e-14) << i;
  }
}

TEST(BodyAttitude, IsHeldToTheOrbitByDefault) {
  const Flyby flyby;
  AttitudeSpec spec;
  spec.offsets = {0.1, -0.2, 0.3};
  const BodyAttitude body(spec, flyby.epoch);
  const OrbitState state = flyby.target.at(flyby.at(1000.0));
  EXPECT_EQ(body.axes(flyby.at(1000.0), state).matrix,
            (body_offset(spec.offsets) * orbital_frame(state)).matrix);
}

TEST(BodyAttitude, HeldToTheStarsItStaysAsItIs) {
  AttitudeSpec spec;
  spec.kind = AttitudeKind::kInertial;
  spec.body_from_j2000 = kSomehow;
  const BodyAttitude body(spec, Epoch{});
  for (const double t_s : {-1e6, 0.0, 1e6})
    EXPECT_EQ(body.axes(Epoch{from_seconds(t_s)}, {}).matrix, kSomehow.toRotationMatrix());
}

TEST(BodyAttitude, SpinsAboutAnAxisOfItsOwn) {
  AttitudeSpec spec;
  spec.kind = AttitudeKind::kSpin;
  spec.spin_axis = Vector3d::UnitZ();
  spec.spin_rate_rad_s = 0.25 * kPi;
  spec.spin_phase_rad = 0.25 * kPi;
  const BodyAttitude body(spec, Epoch{});
  // After a second it has turned by a right angle from x to y: its x axis is where y was.
  const Matrix3d after = body.axes(Epoch{from_seconds(1.0)}, {}).matrix;
  EXPECT_LT((after.row(0).transpose() - Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT((after.row(2).transpose() - Vector3d::UnitZ()).norm(), 1e-15);
  // 50 hours on, 22500 turns: the phase has kept ten digits.
  const Matrix3d late = body.axes(Epoch{from_seconds(180001.0)}, {}).matrix;
  EXPECT_LT((late - after).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(BodyAttitude, ATumblingBodyAboutAPrincipalAxisSpins) {
  AttitudeSpec tumbling;
  tumbling.kind = AttitudeKind::kTumbling;
  tumbling.offsets = {0.3, 0.1, -0.2};
  tumbling.rate_rad_s = 0.1 * Vector3d::UnitZ();
  AttitudeSpec spin = tumbling;
  spin.kind = AttitudeKind::kSpin;
  spin.spin_axis = Vector3d::UnitZ();
  spin.spin_rate_rad_s = 0.1;
  const BodyAttitude a(tumbling, Epoch{});
  const BodyAttitude b(spin, Epoch{});
  for (const double t_s : {0.0, 3.0, 1e4}) {
    const Epoch t{from_seconds(t_s)};
    EXPECT_LT((a.axes(t, {}).matrix - b.axes(t, {}).matrix).cwiseAbs().maxCoeff(), 1e-12) << t_s;
  }
}

AttitudeSpec read(const std::string& text) {
  const ConfigReader config = ConfigReader::from_text("[target]\n" + text, "x.toml");
  AttitudeSpec spec = read_attitude(config.table("target"));
  config.reject_unknown_keys();
  return spec;
}

std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(ReadAttitude, TakesDegrees) {
  EXPECT_EQ(read("").kind, AttitudeKind::kNadir);
  const AttitudeSpec spin = read(
      "attitude = \"spin\"\nspin_axis = [0, 0, 2]\nspin_rate_deg_s = 90\nspin_phase_deg = 180\n"
      "yaw_deg = 90\n");
  EXPECT_DOUBLE_EQ(spin.spin_rate_rad_s, 0.5 * kPi);
  EXPECT_DOUBLE_EQ(spin.spin_phase_rad, kPi);
  EXPECT_EQ(spin.spin_axis, Vector3d::UnitZ());
  EXPECT_DOUBLE_EQ(spin.offsets.yaw_rad, 0.5 * kPi);
  const AttitudeSpec tumbling = read(
      "attitude = \"tumbling\"\nmoments_of_inertia = [100, 200, 250]\nrate_deg_s = [0, 180, 1]\n"
      "quaternion = [0, 0, 0.6, 0.8]\n");
  EXPECT_DOUBLE_EQ(tumbling.inertia.x(), 0.4);
  EXPECT_DOUBLE_EQ(tumbling.rate_rad_s.y(), kPi);
  EXPECT_DOUBLE_EQ(tumbling.body_from_j2000->w(), 0.8);
}

TEST(ReadAttitude, RefusesWithTheKey) {
  const std::string spin = "attitude = \"spin\"\nspin_axis = [0, 0, 1]\n";
  const std::string tumbling = "attitude = \"tumbling\"\nrate_deg_s = [0, 1, 1]\n";
  const std::array<std::array<std::string, 2>, 14> kBad{{
      {"attitude = \"aem\"\n", "target.attitude_file is missing"},
      {"attitude = \"aem\"\nattitude_file = \"/nowhere.aem\"\n",
       "x.toml:3: target.attitude_file is no attitude: /nowhere.aem: expected"},
      {"attitude = \"up\"\n", "target.attitude must be one of"},
      {"attitude = \"spin\"\n", "target.spin_axis is missing"},
      {spin, "target.spin_rate_deg_s is missing"},
      {"attitude = \"spin\"\nspin_axis = [0, 0, 0]\n", "target.spin_axis must not be zero"},
      {spin + "spin_rate_deg_s = nan\n", "target.spin_rate_deg_s must be"},
      {tumbling, "target.moments_of_inertia is missing"},
      {tumbling + "moments_of_inertia = [1, 1, 3]\n", "target.moments_of_inertia must be those"},
      {tumbling + "moments_of_inertia = [0, 1, 1]\n", "target.moments_of_inertia must be a list"},
      {tumbling + "moments_of_inertia = [1, 1.00000001, 1]\n", "are so nearly equal"},
      {"attitude = \"inertial\"\nquaternion = [0, 0, 0, 0.5]\n", "target.quaternion must have"},
      {"attitude = \"inertial\"\nquaternion = [0, 0, 0, 1]\nyaw_deg = 3\n", "exclude each other"},
      {"quaternion = [0, 0, 0, 1]\n", "target.quaternion is not a key"},
  }};
  for (const auto& [text, complaint] : kBad)
    EXPECT_NE(complaint_of(text).find(complaint), std::string::npos) << complaint_of(text);
}

}  // namespace
}  // namespace engine
