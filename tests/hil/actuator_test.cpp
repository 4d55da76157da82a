#include "hil/actuator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace {

using engine::Duration;
using engine::from_seconds;
using engine::sim_time;
using engine::SimTime;
using hil::Actuator;
using hil::ActuatorSpec;

constexpr Duration kStep{1'000'000};
constexpr double kStep_s = 1e-3;

/// An actuator that stands at rest at time 0.
Actuator at_rest(const ActuatorSpec& spec = {}) {
  Actuator actuator(spec);
  actuator.advance_to(SimTime{});
  return actuator;
}

/// Angles at 0, 1, 2, ... ms.
std::vector<double> angles(Actuator& actuator, int steps) {
  std::vector<double> out;
  for (int i = 0; i <= steps; ++i) {
    actuator.advance_to(SimTime(kStep * i));
    out.push_back(actuator.angle_rad());
  }
  return out;
}

TEST(Actuator, StandsStillWithoutACommand) {
  Actuator actuator = at_rest();
  for (const double angle : angles(actuator, 1000)) EXPECT_EQ(angle, 0.0);
}

TEST(Actuator, SmallStepFollowsTheClosedFormOfASecondOrderSystem) {
  const ActuatorSpec spec;  // 5 Hz, damping 0.7
  const double w = 2.0 * engine::kPi * spec.natural_frequency_hz;
  const double z = spec.damping;
  const double wd = w * std::sqrt(1.0 - z * z);
  // The acceleration asked for at first is w^2 times the step: half of the limit.
  const double step_rad = 0.5 * spec.acceleration_limit_rad_s2 / (w * w);
  Actuator actuator = at_rest(spec);
  actuator.follow(step_rad, 0.0, SimTime{});
  const std::vector<double> got = angles(actuator, 1000);
  for (int i = 0; i <= 1000; ++i) {
    const double t = i * kStep_s;
    const double exact = step_rad * (1.0 - std::exp(-z * w * t) *
                                               (std::cos(wd * t) + z * w / wd * std::sin(wd * t)));
    // Semi-implicit Euler is at most one step of 1 ms ahead or behind. The response is never faster
    // than w exp(-z acos(z) / sqrt(1 - z^2)) of the step a second: 14.4 /s, so 1.44 % in 1 ms.
    ASSERT_NEAR(got[static_cast<std::size_t>(i)], exact, 0.0145 * step_rad) << t << " s";
  }
  // exp(-z w t) is 3e-10 after a second; at rest nothing of the steps' error is left.
  EXPECT_NEAR(got.back(), step_rad, 1e-9 * step_rad);
}

TEST(Actuator, OvershootsAsMuchAsItsDampingSays) {
  const ActuatorSpec spec;
  const double z = spec.damping;
  const double step_rad = 5e-6;
  Actuator actuator = at_rest(spec);
  actuator.follow(step_rad, 0.0, SimTime{});
  const std::vector<double> got = angles(actuator, 1000);
  const double overshoot = *std::max_element(got.begin(), got.end()) / step_rad - 1.0;
  // exp(-pi z / sqrt(1 - z^2)) = 4.60 %. At the peak the rate is zero, so a shift in time costs
  // nothing; the steps take from the damping ratio what w h / 2 = 0.0157 is of 1, and d overshoot /
  // d z is -0.40 there: 0.63 %.
  EXPECT_NEAR(overshoot, std::exp(-engine::kPi * z / std::sqrt(1.0 - z * z)), 0.0065);
}

TEST(Actuator, RampWithItsRateFedForwardLeavesNoLagAndNoLead) {
  const double rate_rad_s = 50e-6;  // as the guidance error of config/flyby.toml grows
  Actuator actuator = at_rest();
  actuator.follow(3e-6, rate_rad_s, sim_time(0.5));
  const std::vector<double> got = angles(actuator, 3000);
  for (int i = 2000; i <= 3000; ++i) {
    const double wanted = 3e-6 + rate_rad_s * (i * kStep_s - 0.5);
    // exp(-z w t) of the first error is under 1e-18 rad after 2 s. What is left is rounding: a
    // thousandth of a nanoradian is far above that, and 7e-7 of a pixel.
    ASSERT_NEAR(got[static_cast<std::size_t>(i)], wanted, 1e-12) << i << " ms";
  }
}

TEST(Actuator, BigStepKeepsTheLimitsOnRateAndAcceleration) {
  const ActuatorSpec spec;
  for (const double step_rad : {5e-3, -5e-3}) {
    Actuator actuator = at_rest(spec);
    actuator.follow(step_rad, 0.0, SimTime{});
    const std::vector<double> got = angles(actuator, 20'000);
    double fastest = 0;
    double hardest = 0;
    for (std::size_t i = 2; i < got.size(); ++i) {
      fastest = std::max(fastest, std::abs(got[i] - got[i - 1]) / kStep_s);
      hardest =
          std::max(hardest, std::abs(got[i] - 2.0 * got[i - 1] + got[i - 2]) / (kStep_s * kStep_s));
    }
    // Three angles of 5e-3 rad, each rounded to 4e-19, over (1e-3 s)^2: 2e-12 rad/s^2.
    EXPECT_LE(fastest, spec.rate_limit_rad_s * (1.0 + 1e-9));
    EXPECT_LE(hardest, spec.acceleration_limit_rad_s2 * (1.0 + 1e-9));
    // And it makes use of them: a limit that is never reached proves nothing.
    EXPECT_GE(fastest, spec.rate_limit_rad_s * (1.0 - 1e-9));
    EXPECT_GE(hardest, spec.acceleration_limit_rad_s2 * (1.0 - 1e-9));
    // 5 mrad at 2 mrad/s is 2.5 s; the rest is time enough to settle to rounding.
    EXPECT_NEAR(got.back(), step_rad, 1e-12);
  }
}

TEST(Actuator, MoreCallsAtWholeMillisecondsChangeNoBit) {
  Actuator seldom = at_rest();
  Actuator often = at_rest();
  for (Actuator* actuator : {&seldom, &often}) actuator->follow(2e-3, 1e-4, sim_time(0.25));
  for (int i = 1; i <= 30; ++i) {
    seldom.advance_to(SimTime(kStep * (100 * i)));
    for (int j = 1; j <= 100; ++j)
      if (j % 7 == 0 || j % 5 == 0) often.advance_to(SimTime(kStep * (100 * (i - 1) + j)));
    ASSERT_EQ(seldom.angle_rad(), often.angle_rad()) << i;
  }
}

TEST(Actuator, TheSameInstantTwiceChangesNothing) {
  Actuator actuator = at_rest();
  actuator.follow(1e-3, 0.0, SimTime{});
  actuator.advance_to(sim_time(0.05));
  const double angle = actuator.angle_rad();
  actuator.advance_to(sim_time(0.05));
  EXPECT_EQ(actuator.angle_rad(), angle);
}

// The wire refuses only what is not finite; the rest of the nonsense arrives here.
TEST(Actuator, AbsurdButFiniteCommandsDoNotPoisonIt) {
  constexpr double kHuge = std::numeric_limits<double>::max();
  const ActuatorSpec spec;
  for (const double offset : {kHuge, -kHuge, 0.0}) {
    for (const double rate : {kHuge, -kHuge, 0.0}) {
      for (const SimTime reference : {SimTime{}, SimTime::min(), SimTime::max()}) {
        Actuator actuator = at_rest(spec);
        actuator.follow(offset, rate, reference);
        actuator.advance_to(sim_time(0.1));
        ASSERT_TRUE(std::isfinite(actuator.angle_rad())) << offset << " " << rate;
        ASSERT_LE(std::abs(actuator.angle_rad()), 0.1 * spec.rate_limit_rad_s * (1.0 + 1e-9));
        // And the next sensible command is obeyed: 0.2 mrad back at 2 mrad/s, then it settles.
        actuator.follow(0.0, 0.0, SimTime{});
        actuator.advance_to(sim_time(10.0));
        ASSERT_NEAR(actuator.angle_rad(), 0.0, 1e-12) << offset << " " << rate;
      }
    }
  }
}

}  // namespace
