#include "hil/actuator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"

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

/// What is left of a step of 1 after `t` seconds, from rest: x'' = -w^2 x - 2 z w x'.
double left_of_a_step(double w, double z, double t) {
  if (z == 1.0) return std::exp(-w * t) * (1.0 + w * t);
  const double s = w * std::sqrt(std::abs(1.0 - z * z));
  if (z < 1.0) return std::exp(-z * w * t) * (std::cos(s * t) + z * w / s * std::sin(s * t));
  const double slow = z * w - s;
  const double fast = z * w + s;
  return (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow);
}

TEST(Actuator, StepBetweenTheLimitsIsTheClosedFormOfASecondOrderSystem) {
  for (const double frequency_hz : {0.5, 5.0, 60.0}) {
    for (const double damping : {0.1, 0.7, 1.0, 4.0}) {
      SCOPED_TRACE(testing::Message() << frequency_hz << " Hz, damping " << damping);
      ActuatorSpec spec;
      spec.natural_frequency_hz = frequency_hz;
      spec.damping = damping;
      spec.rate_limit_rad_s = 1.0;
      const double w = 2.0 * engine::kPi * frequency_hz;
      // The acceleration asked for at first is w^2 times the step: nine tenths of the limit.
      const double step_rad = 0.9 * spec.acceleration_limit_rad_s2 / (w * w);
      Actuator actuator = at_rest(spec);
      actuator.follow(step_rad, 0.0, SimTime{});
      // Not only at whole milliseconds.
      SimTime t{};
      for (int i = 0; i < 2000; ++i) {
        t += Duration(150'000 + 811 * (i % 1000));
        actuator.advance_to(t);
        const double exact = 1.0 - left_of_a_step(w, damping, engine::seconds(t));
        // Each of at most 2e5 substeps rounds by an ulp or two of 1, and forgets at the rate that
        // the damping says.
        ASSERT_NEAR(actuator.angle_rad() / step_rad, exact, 1e-11) << engine::seconds(t) << " s";
      }
    }
  }
}

TEST(Actuator, OvershootsAsMuchAsItsDampingSays) {
  const double z = ActuatorSpec{}.damping;
  const double step_rad = 5e-6;
  Actuator actuator = at_rest();
  actuator.follow(step_rad, 0.0, SimTime{});
  const std::vector<double> got = angles(actuator, 1000);
  const double overshoot = *std::max_element(got.begin(), got.end()) / step_rad - 1.0;
  // exp(-pi z / sqrt(1 - z^2)) = 4.60 %. The peak lies within half a millisecond of a sample, and
  // is as sharp as w^2 times the overshoot: (31.4 0.5e-3)^2 / 2 = 1.2e-4 of it.
  EXPECT_NEAR(overshoot, std::exp(-engine::kPi * z / std::sqrt(1.0 - z * z)), 6e-6);
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

TEST(Actuator, RandomCommandsNeverTakeItBeyondItsLimits) {
  for (const double frequency_hz : {1.0, 5.0, 40.0}) {
    SCOPED_TRACE(frequency_hz);
    ActuatorSpec spec;
    spec.natural_frequency_hz = frequency_hz;
    Actuator actuator = at_rest(spec);
    double before = 0;
    double rate_before = 0;
    double fastest = 0;
    double hardest = 0;
    for (std::uint32_t i = 1; i <= 100'000; ++i) {
      engine::Draws draws(7, engine::Stream::kLight, 0, i);
      if (draws.uniform() < 0.02F) {
        // From microradians to the whole range, so that both the limits and the space between them
        // are visited.
        const double size = std::pow(10.0, -6.0 + 4.0 * draws.uniform_double());
        actuator.follow(size * (2.0 * draws.uniform_double() - 1.0),
                        size * (2.0 * draws.uniform_double() - 1.0), SimTime(kStep * i));
      }
      actuator.advance_to(SimTime(kStep * i));
      const double rate = (actuator.angle_rad() - before) / kStep_s;
      fastest = std::max(fastest, std::abs(rate));
      hardest = std::max(hardest, std::abs(rate - rate_before) / kStep_s);
      rate_before = rate;
      before = actuator.angle_rad();
    }
    // Angles up to 0.3 rad, rounded to 6e-17, over a millisecond, and twice that over its square.
    EXPECT_LE(fastest, spec.rate_limit_rad_s + 2e-13);
    EXPECT_LE(hardest, spec.acceleration_limit_rad_s2 + 4e-10);
    EXPECT_GE(fastest, 0.999 * spec.rate_limit_rad_s);
    EXPECT_GE(hardest, 0.999 * spec.acceleration_limit_rad_s2);
  }
}

TEST(Actuator, StopsAtItsAngleLimit) {
  ActuatorSpec spec;
  spec.angle_limit_rad = 1e-3;
  spec.damping = 0.2;  // without a stop it would swing beyond
  spec.rate_limit_rad_s = 1.0;
  spec.acceleration_limit_rad_s2 = 10.0;
  for (const double sign : {1.0, -1.0}) {
    Actuator actuator = at_rest(spec);
    actuator.follow(sign * 0.5, sign * 0.1, SimTime{});
    double furthest = 0;
    for (const double angle : angles(actuator, 5000))
      furthest = std::max(furthest, std::abs(angle));
    EXPECT_EQ(furthest, spec.angle_limit_rad);
    EXPECT_NEAR(actuator.angle_rad(), sign * spec.angle_limit_rad, 1e-12);
  }
}

TEST(Actuator, ComesInFromBeyondItsAngleLimit) {
  ActuatorSpec spec;
  spec.angle_limit_rad = 1e-3;
  Actuator actuator = at_rest(spec);
  actuator.place(5e-3, 0.0);
  actuator.follow(2e-3, 0.0, SimTime{});
  const std::vector<double> got = angles(actuator, 5000);
  EXPECT_NEAR(got[1], 5e-3, 1e-8);  // no jump: half of 10 mrad/s^2 times (1 ms)^2 is 5e-9
  EXPECT_NEAR(got.back(), 1e-3, 1e-12);
}

TEST(Actuator, OffsetsAreRoundedToTheCommandStep) {
  ActuatorSpec spec;
  spec.command_step_rad = 4e-6;
  for (const auto& [asked, given] :
       {std::pair{9.9e-6, 8e-6}, std::pair{-10.1e-6, -12e-6}, std::pair{1.9e-6, 0.0}}) {
    Actuator actuator = at_rest(spec);
    actuator.follow(asked, 0.0, SimTime{});
    actuator.advance_to(sim_time(3.0));
    EXPECT_NEAR(actuator.angle_rad(), given, 1e-12) << asked;
  }
}

TEST(Actuator, IdealIsThereAtOnce) {
  ActuatorSpec spec;
  spec.ideal = true;
  Actuator actuator = at_rest(spec);
  actuator.follow(0.3, -0.1, sim_time(1.0));
  actuator.advance_to(SimTime{});
  EXPECT_DOUBLE_EQ(actuator.angle_rad(), 0.4);
  actuator.advance_to(sim_time(4.0));
  EXPECT_NEAR(actuator.angle_rad(), 0.0, 1e-15);
  EXPECT_EQ(actuator.rate_rad_s(), -0.1);
}

TEST(Actuator, HoldsUntilTheReferenceOfATurn) {
  ActuatorSpec spec;
  spec.ideal = true;
  Actuator actuator = at_rest(spec);
  actuator.turn_from(1e-3, 2e-3, sim_time(2.0));
  for (const auto& [t, angle] :
       {std::pair{0.5, 1e-3}, std::pair{2.0, 1e-3}, std::pair{3.0, 3e-3}}) {
    actuator.advance_to(sim_time(t));
    EXPECT_DOUBLE_EQ(actuator.angle_rad(), angle) << t;
  }
}

TEST(Actuator, BiasAndDriftAreNotSeenByItsOwnSensor) {
  ActuatorSpec spec;
  spec.bias_rad = {1e-6, -2e-6, 3e-6};
  spec.drift_rad_s = {1e-8, 0.0, -1e-8};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Actuator actuator(spec, axis);
    actuator.advance_to(sim_time(5.0));
    actuator.advance_to(sim_time(15.0));
    EXPECT_EQ(actuator.angle_rad(), 0.0);
    EXPECT_DOUBLE_EQ(actuator.unseen_rad(), spec.bias_rad[axis] + 10.0 * spec.drift_rad_s[axis]);
  }
}

TEST(Actuator, ALongWayIsBrakedInTime) {
  ActuatorSpec spec;
  spec.rate_limit_rad_s = 0.5;
  spec.acceleration_limit_rad_s2 = 0.05;
  // The whole way is acceleration and braking: the rate limit is out of reach.
  const double way_rad = 1.5;
  Actuator actuator = at_rest(spec);
  actuator.follow(way_rad, 0.0, SimTime{});
  const std::vector<double> got = angles(actuator, 20'000);
  const double furthest = *std::max_element(got.begin(), got.end());
  // It brakes as if it had to stop A / w^2 beyond, and lags its rate by 3/4 A / (2 z w): 0.54 A /
  // w.
  const double w = 2.0 * engine::kPi * spec.natural_frequency_hz;
  EXPECT_LT(furthest - way_rad, 2.0 * spec.acceleration_limit_rad_s2 / (w * w));
  // Accelerating at A and braking at 3/4 A takes sqrt(2 s (1 + 4/3) / A) = 11.8 s, and settling.
  EXPECT_NEAR(got[12'800], way_rad, 1e-6);
}

TEST(Actuator, ARateBeyondItsLimitComesDownAsFastAsItMay) {
  const ActuatorSpec spec;
  Actuator actuator = at_rest(spec);
  actuator.place(0.0, 12e-3);  // 10 mrad/s too fast: a second at 10 mrad/s^2
  actuator.follow(0.0, 0.0, SimTime{});
  for (int i = 1; i <= 1000; ++i) {
    actuator.advance_to(SimTime(kStep * i));
    ASSERT_NEAR(actuator.rate_rad_s(), 12e-3 - 10e-3 * i * kStep_s, 1e-12);
  }
  actuator.advance_to(sim_time(30.0));
  EXPECT_NEAR(actuator.angle_rad(), 0.0, 1e-12);
}

TEST(Actuator, WhatIsNotFiniteIsIgnored) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Actuator actuator = at_rest();
  actuator.follow(1e-4, 0.0, SimTime{});
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    actuator.follow(bad, 0.0, SimTime{});
    actuator.follow(0.0, bad, SimTime{});
    actuator.turn_from(bad, 0.0, SimTime{});
    actuator.turn_from(0.0, bad, SimTime{});
  }
  actuator.advance_to(sim_time(3.0));
  EXPECT_NEAR(actuator.angle_rad(), 1e-4, 1e-12);
}

std::string scenario_with(const std::string& lines) {
  return "[actuator]\nnatural_frequency_hz = 5\ndamping = 0.7\nrate_limit_mrad_s = 2\n"
         "acceleration_limit_mrad_s2 = 10\n" +
         lines;
}

TEST(Actuator, WhatTheScenarioDoesNotSayIsLeftOut) {
  const auto config = engine::ConfigReader::from_text(scenario_with(""), "a.toml");
  const ActuatorSpec spec = hil::read_actuator(config.table("actuator"));
  EXPECT_EQ(spec.delay, Duration{});
  EXPECT_EQ(spec.angle_limit_rad, engine::kPi);
  EXPECT_EQ(spec.command_step_rad, 0.0);
  EXPECT_FALSE(spec.ideal);
  EXPECT_EQ(spec.bias_rad, (std::array<double, 3>{}));
  EXPECT_EQ(spec.drift_rad_s, (std::array<double, 3>{}));
}

TEST(Actuator, ScenarioIsReadInItsUnits) {
  const auto config = engine::ConfigReader::from_text(
      scenario_with("response = \"ideal\"\ndelay_ms = 30\nangle_limit_mrad = 5\n"
                    "command_step_urad = 0.5\nbias_x_urad = 1\nbias_y_urad = 2\n"
                    "bias_roll_urad = 3\ndrift_x_urad_s = 4\ndrift_y_urad_s = 5\n"
                    "drift_roll_urad_s = 6\n"),
      "a.toml");
  const ActuatorSpec spec = hil::read_actuator(config.table("actuator"));
  config.reject_unknown_keys();
  EXPECT_TRUE(spec.ideal);
  EXPECT_EQ(spec.delay, Duration(30'000'000));
  EXPECT_DOUBLE_EQ(spec.angle_limit_rad, 5e-3);
  EXPECT_DOUBLE_EQ(spec.command_step_rad, 0.5e-6);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(spec.bias_rad[i], (1.0 + static_cast<double>(i)) * 1e-6);
    EXPECT_DOUBLE_EQ(spec.drift_rad_s[i], (4.0 + static_cast<double>(i)) * 1e-6);
  }
}

TEST(Actuator, ScenarioErrorsNameTheirLine) {
  const auto config = engine::ConfigReader::from_text(scenario_with("delay_ms = -1\n"), "a.toml");
  try {
    static_cast<void>(hil::read_actuator(config.table("actuator")));
    FAIL();
  } catch (const engine::ConfigError& e) {
    EXPECT_STREQ(e.what(), "a.toml:6: actuator.delay_ms must be >= 0 and <= 10000, got -1");
  }
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
