// The camera that obeys: modes, attitudes and rates through actuator, delay, vibration and sensors.

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "hil/closed_loop_pointing.h"
#include "hil/turn.h"
#include "tests/support/bodies.h"

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::Duration;
using engine::kPi;
using engine::sim_time;
using engine::SimTime;
using hil::ClosedLoopPointing;
using hil::Command;
using hil::CommandKind;
using hil::GuidanceMode;
using hil::PointingSpec;

// Unit vectors and rotations of doubles, a few products.
constexpr double kRounding = 1e-14;
constexpr double kOrbitRate_rad_s = 1.1e-3;
constexpr Duration kMillisecond{1'000'000};

Command mode_command(GuidanceMode mode) {
  Command c;
  c.kind = CommandKind::kMode;
  c.mode = mode;
  return c;
}
Command trim_command(double x_rad, double y_rad) {
  Command c;
  c.kind = CommandKind::kTrim;
  c.trim_offset_rad = {x_rad, y_rad};
  return c;
}
Command attitude_command(const Matrix3d& axes, SimTime reference,
                         const Vector3d& rate = {0, 0, 0}) {
  Command c;
  c.kind = CommandKind::kAttitude;
  c.attitude.j2000_to_camera = hil::quaternion_of(axes);
  c.attitude.rate_rad_s = {rate.x(), rate.y(), rate.z()};
  c.reference = reference;
  return c;
}
Command rate_command(double x_rad_s, double y_rad_s, SimTime reference) {
  Command c;
  c.kind = CommandKind::kRate;
  c.trim_rate_rad_s = {x_rad_s, y_rad_s};
  c.reference = reference;
  return c;
}

/// By how much the camera has turned from one attitude to another.
Vector3d turn_between(const Matrix3d& from, const Matrix3d& to) {
  return hil::turn_of(to * from.transpose());
}

class PointingModes : public testing::Test {
 protected:
  [[nodiscard]] ClosedLoopPointing pointing(const PointingSpec& spec,
                                            hil::Jitter jitter = {}) const {
    return {hil::ScriptedPointing(camera_, target_, engine::Epoch{}, engine::LightPath::kGeometric,
                                  hil::RollRule::kVertical),
            spec, std::move(jitter)};
  }
  /// A body that turns: half a turn takes some ten seconds.
  static PointingSpec agile() {
    PointingSpec spec;
    spec.actuator.natural_frequency_hz = 1.0;
    spec.actuator.rate_limit_rad_s = 0.5;
    spec.actuator.acceleration_limit_rad_s2 = 0.2;
    return spec;
  }
  static PointingSpec ideal() {
    PointingSpec spec;
    spec.actuator.ideal = true;
    return spec;
  }
  static Matrix3d axes_at(ClosedLoopPointing& p, SimTime t) { return p.attitude(t).axes.matrix; }

  /// Over the equator, eastward.
  test_support::CirclingBody camera_{Vector3d(7e6, 0, 0), Vector3d::UnitZ(), kOrbitRate_rad_s};
  test_support::FixedBody target_{Vector3d(7.1e6, 2e5, -1e5)};
};

TEST_F(PointingModes, FirstModeIsWhereTheCameraLooksFromTheBeginning) {
  for (const GuidanceMode mode : {GuidanceMode::kPredictedTarget, GuidanceMode::kNadir,
                                  GuidanceMode::kInertial, GuidanceMode::kCommanded}) {
    PointingSpec spec = agile();
    spec.mode = mode;
    ClosedLoopPointing p = pointing(spec);
    ClosedLoopPointing predicted = pointing(agile());
    const Matrix3d axes = axes_at(p, sim_time(10.0));
    const Matrix3d first = axes_at(predicted, sim_time(10.0));
    if (mode == GuidanceMode::kNadir) {
      const Vector3d nadir = -camera_.at(engine::Epoch{engine::from_seconds(10.0)}).position.m;
      EXPECT_NEAR((axes * nadir.normalized() - Vector3d::UnitZ()).norm(), 0.0, kRounding);
    } else {
      EXPECT_NEAR((axes - first).norm(), 0.0, kRounding);
    }
    if (mode == GuidanceMode::kInertial || mode == GuidanceMode::kCommanded) {
      EXPECT_NEAR((axes_at(p, sim_time(60.0)) - first).norm(), 0.0, kRounding);
    }
  }
}

TEST_F(PointingModes, AttitudeAndRateGoOnWithoutAJumpWhateverLineIsSet) {
  const PointingSpec spec = agile();
  ClosedLoopPointing p = pointing(spec);
  Matrix3d last = axes_at(p, SimTime{});
  Vector3d last_turn = turn_between(last, axes_at(p, SimTime(kMillisecond)));
  last = axes_at(p, SimTime(kMillisecond));
  const double dt_s = engine::seconds(kMillisecond);
  int changes = 0;
  for (int i = 2; i < 60'000; ++i) {
    const SimTime t = SimTime(kMillisecond * i);
    const Matrix3d axes = axes_at(p, t);
    const Vector3d turn = turn_between(last, axes);
    // Three axes, each with its own limit; the lines turn by 3 mrad/s at most, and hardly change
    // their rate. A turn of the rotation vector is no less than that of the camera.
    ASSERT_LE((turn - last_turn).norm() / (dt_s * dt_s),
              1.1 * std::sqrt(3.0) * spec.actuator.acceleration_limit_rad_s2)
        << t.time_since_epoch().count();
    ASSERT_LE(turn.norm() / dt_s, std::sqrt(3.0) * spec.actuator.rate_limit_rad_s + 3e-3);
    last = axes;
    last_turn = turn;
    if (i % 1777 != 0) continue;
    ++changes;
    engine::Draws draws(1, engine::Stream::kLight, 0, static_cast<std::uint32_t>(i));
    const auto any = [&] { return 6.0 * draws.uniform_double() - 3.0; };
    if (changes % 3 == 0) {
      p.apply(attitude_command(hil::axes_turned({any(), any(), any()}), t, {1e-3, 0, -2e-3}));
    } else if (changes % 3 == 1) {
      p.apply(mode_command(static_cast<GuidanceMode>((changes / 3) % 4)));
    } else {
      p.apply(trim_command(0.01 * any(), 0.01 * any()));
    }
    // The same instant again: what was set shows only from here on.
    ASSERT_NEAR(turn_between(axes, axes_at(p, t)).norm(), 0.0, 1e-12);
  }
  EXPECT_EQ(changes, 33);
}

TEST_F(PointingModes, LargeSlewsEndAtTheCommand) {
  for (const Vector3d& turn :
       {Vector3d(kPi / 2, 0, 0), Vector3d(0, kPi, 0), Vector3d(0, 0, kPi), Vector3d(0, 0, -kPi / 2),
        Vector3d(1.5, -1.5, 2.2), Vector3d(kPi, 0, 0)}) {
    SCOPED_TRACE(turn.transpose());
    PointingSpec spec = agile();
    spec.mode = GuidanceMode::kInertial;
    ClosedLoopPointing p = pointing(spec);
    const Matrix3d wanted = hil::axes_turned(turn) * axes_at(p, SimTime{});
    p.apply(attitude_command(wanted, SimTime{}));
    EXPECT_EQ(p.mode(), GuidanceMode::kCommanded);
    double furthest = 0;
    for (int i = 1; i < 300; ++i) {
      const double off = turn_between(axes_at(p, sim_time(0.1 * i)), wanted).norm();
      ASSERT_TRUE(std::isfinite(off));
      furthest = std::max(furthest, off);
    }
    EXPECT_LE(furthest, turn.norm() + 1e-12);  // it went there, not round about
    EXPECT_NEAR(turn_between(axes_at(p, sim_time(30.0)), wanted).norm(), 0.0, 1e-9);
  }
}

TEST_F(PointingModes, AttitudeCommandWithARateIsFollowedWithoutALag) {
  ClosedLoopPointing p = pointing(agile());
  const Matrix3d start = axes_at(p, SimTime{});
  const Vector3d rate(2e-3, -1e-3, 5e-3);
  p.apply(attitude_command(start, SimTime{}, rate));
  for (const double t : {30.0, 31.0, 45.0}) {
    const Matrix3d wanted = hil::axes_turned(t * rate) * start;
    EXPECT_NEAR(turn_between(axes_at(p, sim_time(t)), wanted).norm(), 0.0, 1e-9) << t;
  }
}

TEST_F(PointingModes, InertialKeepsTheAttitudeOfItsInstantTrimsIncluded) {
  PointingSpec spec = agile();
  spec.mode = GuidanceMode::kInertial;
  ClosedLoopPointing p = pointing(spec);
  static_cast<void>(p.attitude(SimTime{}));
  p.apply(trim_command(0.02, -0.03));
  const Matrix3d trimmed = axes_at(p, sim_time(20.0));
  p.apply(mode_command(GuidanceMode::kInertial));
  EXPECT_NEAR(turn_between(trimmed, axes_at(p, sim_time(20.0))).norm(), 0.0, kRounding);
  EXPECT_NEAR(turn_between(trimmed, axes_at(p, sim_time(90.0))).norm(), 0.0, kRounding);
  EXPECT_NEAR(p.trim_rad()[0], 0.0, kRounding);
}

TEST_F(PointingModes, TrimsAreRelativeToTheModesLine) {
  ClosedLoopPointing p = pointing(agile());
  static_cast<void>(p.attitude(SimTime{}));
  p.apply(mode_command(GuidanceMode::kNadir));
  static_cast<void>(p.attitude(sim_time(60.0)));
  p.apply(trim_command(1e-3, 0.0));
  const Matrix3d axes = axes_at(p, sim_time(120.0));
  const Vector3d nadir =
      axes * -camera_.at(engine::Epoch{engine::from_seconds(120.0)}).position.m.normalized();
  EXPECT_NEAR(std::atan2(nadir.x(), nadir.z()), -1e-3, 1e-9);
  EXPECT_NEAR(nadir.y(), 0.0, 1e-9);
}

TEST_F(PointingModes, ARateStartsFromWhereTheBoresightWasAtItsReference) {
  ClosedLoopPointing p = pointing(ideal());
  static_cast<void>(p.attitude(SimTime{}));
  Command trim = trim_command(1e-3, 0.0);
  trim.trim_rate_rad_s = {0.0, 2e-3};
  p.apply(trim);
  for (const double t : {0.1, 0.2, 0.3}) static_cast<void>(p.attitude(sim_time(t)));
  // At 0.15 s it was at (1e-3, 0.3e-3).
  p.apply(rate_command(-1e-3, 0.0, sim_time(0.15)));
  static_cast<void>(p.attitude(sim_time(1.15)));
  EXPECT_NEAR(p.trim_rad()[0], 0.0, 1e-15);
  EXPECT_NEAR(p.trim_rad()[1], 0.3e-3, 1e-15);
}

TEST_F(PointingModes, ARateWithAReferenceToComeHoldsUntilThen) {
  ClosedLoopPointing p = pointing(ideal());
  static_cast<void>(p.attitude(SimTime{}));
  p.apply(trim_command(1e-3, 0.0));
  static_cast<void>(p.attitude(sim_time(0.1)));
  p.apply(rate_command(1e-3, 0.0, sim_time(2.0)));
  static_cast<void>(p.attitude(sim_time(1.9)));
  EXPECT_NEAR(p.trim_rad()[0], 1e-3, 1e-15);
  static_cast<void>(p.attitude(sim_time(3.0)));
  EXPECT_NEAR(p.trim_rad()[0], 2e-3, 1e-15);
}

TEST_F(PointingModes, DelayIsExactAndKeepsTheOrder) {
  PointingSpec spec = ideal();
  spec.actuator.delay = Duration(30'000'000);
  ClosedLoopPointing p = pointing(spec);
  static_cast<void>(p.attitude(sim_time(1.0)));
  p.apply(trim_command(1e-3, 0.0));
  static_cast<void>(p.attitude(sim_time(1.01)));
  p.apply(trim_command(2e-3, 0.0));
  const auto trim_at = [&](SimTime t) {
    static_cast<void>(p.attitude(t));
    return p.trim_rad()[0];
  };
  EXPECT_EQ(trim_at(sim_time(1.03) - Duration(1)), 0.0);
  EXPECT_EQ(trim_at(sim_time(1.03)), 1e-3);
  EXPECT_EQ(trim_at(sim_time(1.04) - Duration(1)), 1e-3);
  EXPECT_EQ(trim_at(sim_time(1.04)), 2e-3);
  // Between two looks both come due, each at its own time: the second one counts.
  p.apply(trim_command(3e-3, 0.0));
  p.apply(trim_command(4e-3, 0.0));
  EXPECT_EQ(trim_at(sim_time(9.0)), 4e-3);
}

TEST_F(PointingModes, ADelayedModeChangeHoldsTheAttitudeOfItsOwnInstant) {
  PointingSpec spec = ideal();
  spec.actuator.delay = Duration(500'000'000);
  ClosedLoopPointing p = pointing(spec);
  ClosedLoopPointing predicted = pointing(ideal());
  static_cast<void>(p.attitude(SimTime{}));
  p.apply(mode_command(GuidanceMode::kInertial));
  const Matrix3d axes = axes_at(p, sim_time(3.0));
  EXPECT_NEAR((axes - axes_at(predicted, sim_time(0.5))).norm(), 0.0, kRounding);
}

TEST_F(PointingModes, MoreUnderWayThanThereIsRoomForAreLostAndCounted) {
  PointingSpec spec = ideal();
  spec.actuator.delay = Duration(1'000'000);
  ClosedLoopPointing p = pointing(spec);
  static_cast<void>(p.attitude(SimTime{}));
  for (int i = 0; i < 1500; ++i) p.apply(trim_command(1e-6 * i, 0.0));
  EXPECT_EQ(p.refused(), 1500U - 1024U);
  static_cast<void>(p.attitude(sim_time(1.0)));
  EXPECT_DOUBLE_EQ(p.trim_rad()[0], 1023e-6);
}

TEST_F(PointingModes, CommandsBeforeTheFirstLookAreObeyedAtIt) {
  ClosedLoopPointing p = pointing(ideal());
  p.apply(trim_command(1e-3, 0.0));
  p.apply(rate_command(1e-3, 0.0, sim_time(5.0)));
  p.apply(mode_command(GuidanceMode::kNadir));
  p.apply(trim_command(3e-3, 0.0));
  static_cast<void>(p.attitude(sim_time(5.0)));
  EXPECT_EQ(p.trim_rad()[0], 3e-3);
  EXPECT_EQ(p.mode(), GuidanceMode::kNadir);
}

TEST_F(PointingModes, ReportsPingsAndTriggersChangeNoBit) {
  ClosedLoopPointing untouched = pointing(agile());
  ClosedLoopPointing told = pointing(agile());
  for (int i = 0; i < 30; ++i) {
    const SimTime t = sim_time(0.1 * i);
    ASSERT_EQ(axes_at(untouched, t), axes_at(told, t));
    if (i % 5 == 0) {
      untouched.apply(trim_command(1e-3 * i, 2e-3));
      told.apply(trim_command(1e-3 * i, 2e-3));
    }
    for (const CommandKind kind :
         {CommandKind::kReport, CommandKind::kPing, CommandKind::kTrigger}) {
      Command command = attitude_command(hil::axes_turned({1, 1, 1}), t, {1, 1, 1});
      command.trim_offset_rad = {0.1, 0.1};
      command.mode = GuidanceMode::kNadir;
      command.kind = kind;
      told.apply(command);
    }
  }
}

TEST_F(PointingModes, VibrationShakesTheBoresightAtEveryInstant) {
  hil::JitterSpec jitter;
  jitter.lines = {{70.0, 30e-6, 0.9, 0.2}};
  ClosedLoopPointing shaken = pointing(agile(), hil::Jitter(jitter, 1, SimTime{}));
  ClosedLoopPointing still = pointing(agile());
  const hil::Jitter same(jitter, 1, SimTime{});
  for (int i = 0; i < 100; ++i) {
    const SimTime t = sim_time(3.0 + 0.0005 * i);
    const Vector3d turn = turn_between(axes_at(still, t), axes_at(shaken, t));
    const hil::TrimAngles off = same.at(t);
    ASSERT_NEAR((turn - Vector3d(-off[1], off[0], 0.0)).norm(), 0.0, kRounding);
  }
  EXPECT_EQ(shaken.trim_rad(), still.trim_rad());  // the actuator's sensor does not see it
}

TEST_F(PointingModes, BiasAndDriftTurnTheCameraUnseen) {
  PointingSpec spec = agile();
  spec.actuator.bias_rad = {10e-6, -20e-6, 30e-6};
  spec.actuator.drift_rad_s = {1e-6, 0.0, 0.0};
  ClosedLoopPointing biased = pointing(spec);
  ClosedLoopPointing straight = pointing(agile());
  static_cast<void>(biased.attitude(sim_time(1.0)));
  static_cast<void>(straight.attitude(sim_time(1.0)));
  const SimTime t = sim_time(6.0);
  const Vector3d turn = turn_between(axes_at(straight, t), axes_at(biased, t));
  EXPECT_NEAR((turn - Vector3d(20e-6, 15e-6, 30e-6)).norm(), 0.0, kRounding);
  EXPECT_EQ(biased.trim_rad(), (hil::TrimAngles{}));
}

TEST_F(PointingModes, ExactSensorsSayTheAttitudeAndTheRateOfAnOrbit) {
  PointingSpec spec = agile();
  spec.mode = GuidanceMode::kNadir;
  ClosedLoopPointing p = pointing(spec);
  static_cast<void>(p.attitude(sim_time(1.0)));
  const Matrix3d axes = axes_at(p, sim_time(1.0005));
  const hil::MeasuredAttitude m = p.measured();
  EXPECT_NEAR((hil::axes_of(m.j2000_to_camera) - axes).norm(), 0.0, kRounding);
  // Once an orbit about the orbit's normal, which is -y; 1e-16 of rounding over half a millisecond.
  EXPECT_NEAR(m.rate_rad_s[0], 0.0, 3e-12);
  EXPECT_NEAR(m.rate_rad_s[1], -kOrbitRate_rad_s, 3e-12);
  EXPECT_NEAR(m.rate_rad_s[2], 0.0, 3e-12);
  static_cast<void>(p.attitude(sim_time(1.0005)));  // the same instant again
  EXPECT_EQ(p.measured().rate_rad_s, m.rate_rad_s);
}

TEST_F(PointingModes, ACameraThatCannotKeepUpComesBackTheShortWay) {
  PointingSpec spec = agile();
  spec.mode = GuidanceMode::kInertial;
  spec.actuator.rate_limit_rad_s = 10.0;
  ClosedLoopPointing p = pointing(spec);
  const Matrix3d start = axes_at(p, SimTime{});
  // A line that turns away at 3 rad/s: at 0.2 rad/s^2 the camera has its rate after 15 s, and is 22
  // rad behind by then.
  p.apply(attitude_command(start, SimTime{}, {0.0, 0.0, 3.0}));
  for (int i = 1; i <= 600; ++i) ASSERT_TRUE(axes_at(p, sim_time(0.1 * i)).allFinite());
  p.apply(attitude_command(start, SimTime{}));
  // It takes 15 s to stand still, by the limit and no sooner; from there half a turn at most, not
  // 22 rad: 9 s, not 44.
  Matrix3d last = axes_at(p, sim_time(60.0));
  double last_rate_rad_s = 0.0;
  for (int i = 601; i <= 900; ++i) {
    const Matrix3d axes = axes_at(p, sim_time(0.1 * i));
    const double rate_rad_s = turn_between(last, axes).z() / 0.1;
    if (i > 601) {
      ASSERT_LE(std::abs(rate_rad_s - last_rate_rad_s), 1.01 * 0.2 * 0.1) << i;
    }
    last = axes;
    last_rate_rad_s = rate_rad_s;
  }
  EXPECT_NEAR(turn_between(last, start).norm(), 0.0, 1e-9);
}

TEST_F(PointingModes, AngleLimitHoldsTrimsButNotSlews) {
  PointingSpec spec = agile();
  spec.mode = GuidanceMode::kInertial;
  spec.actuator.angle_limit_rad = 5e-3;
  ClosedLoopPointing p = pointing(spec);
  const Matrix3d start = axes_at(p, SimTime{});
  const Matrix3d wanted = hil::axes_turned({0.0, 1.0, 0.0}) * start;
  p.apply(attitude_command(wanted, SimTime{}));
  EXPECT_NEAR(turn_between(start, axes_at(p, SimTime{})).norm(), 0.0, kRounding);
  EXPECT_NEAR(turn_between(wanted, axes_at(p, sim_time(30.0))).norm(), 0.0, 1e-9);
  p.apply(trim_command(0.0, 0.1));
  static_cast<void>(p.attitude(sim_time(60.0)));
  EXPECT_NEAR(p.trim_rad()[1], 5e-3, 1e-9);
}

TEST_F(PointingModes, NothingThatCanBeCommandedMakesItLoseItsAttitude) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kHuge = std::numeric_limits<double>::max();
  const std::array values{0.0, 1e-6, -1.0, kPi, 1e300, kHuge, -kHuge, kNaN, 1.0 / 0.0};
  const std::array times{SimTime{}, SimTime::min(), SimTime::max(), sim_time(5.0)};
  for (const bool perfect : {false, true}) {
    ClosedLoopPointing p = pointing(perfect ? ideal() : agile());
    for (std::uint32_t i = 0; i < 5000; ++i) {
      engine::Draws draws(2, engine::Stream::kLight, 0, i);
      const auto any = [&] { return values[draws.bits() % values.size()]; };
      Command c;
      c.kind = static_cast<CommandKind>(draws.bits() % hil::kCommandKinds);
      c.mode = static_cast<GuidanceMode>(draws.bits() % 8);
      c.trim_offset_rad = {any(), any()};
      c.trim_rate_rad_s = {any(), any()};
      c.attitude.j2000_to_camera = {any(), any(), any(), any()};
      if (draws.bits() % 2 == 0) c.attitude.j2000_to_camera = {0.5, 0.5, -0.5, 0.5};
      c.attitude.rate_rad_s = {any(), any(), any()};
      c.reference = times[draws.bits() % times.size()];
      p.apply(c);
      const Matrix3d axes = axes_at(p, SimTime(kMillisecond * (7 * i)));
      ASSERT_NEAR((axes * axes.transpose() - Matrix3d::Identity()).norm(), 0.0, 1e-12) << i;
    }
    EXPECT_GT(p.refused(), 100U);
    p.apply(mode_command(GuidanceMode::kNadir));
    // After 35 s of commands the camera turns at 4 pi rad/s at most: 63 s at 0.2 rad/s^2 to stand
    // still, and half a turn back.
    const Matrix3d axes = axes_at(p, sim_time(120.0));
    const Vector3d nadir = -camera_.at(engine::Epoch{engine::from_seconds(120.0)}).position.m;
    EXPECT_NEAR((axes * nadir.normalized() - Vector3d::UnitZ()).norm(), 0.0, 1e-9);
  }
}

TEST_F(PointingModes, ATargetThatIsNotWhereItIsBelievedShowsAtErrorOverRange) {
  const test_support::CirclingBody target(Vector3d(7.1e6, 0, 0), Vector3d::UnitZ(), 1.05e-3);
  const hil::BelievedTarget believed(target, {.along_m = 50.0});
  ClosedLoopPointing p(
      hil::ScriptedPointing(camera_, believed, engine::Epoch{}, engine::LightPath::kGeometric,
                            hil::RollRule::kCelestial),
      ideal());
  // Straight above at 100 km; its track is along J2000's y.
  const Matrix3d axes = axes_at(p, SimTime{});
  EXPECT_NEAR(engine::angle_between_rad(axes * Vector3d::UnitX(), Vector3d::UnitZ()),
              std::atan2(50.0, 1e5), kRounding);
}

}  // namespace
