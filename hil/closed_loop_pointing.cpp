#include "hil/closed_loop_pointing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hil/turn.h"

namespace hil {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using engine::CameraAttitude;
using engine::Duration;
using engine::kPi;
using engine::SimTime;

namespace {

constexpr std::size_t kMostUnderWay = 1024;
constexpr double kFastest_rad_s = 2.0 * kPi;  // of a command
// No line turns faster than one, nor does a camera that follows it: twice that is between them.
constexpr double kFastestTurn_rad_s = 2.0 * kFastest_rad_s;
constexpr Duration kInstant{1'000'000};  // over which rates are carried from line to line
// The longest without a look at which way is the short one: at 2 pi a second a tenth of a turn.
constexpr Duration kStretch{100'000'000};

/// Tilting the boresight by x towards u and y towards v is a turn about -y and x.
Vector3d turn_towards(double x_rad, double y_rad, double roll_rad) noexcept {
  return {-y_rad, x_rad, roll_rad};
}

template <class Numbers>
bool finite(const Numbers& numbers) noexcept {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

bool can_be_obeyed(const Command& c) noexcept {
  switch (c.kind) {
    case CommandKind::kTrim:
      return finite(c.trim_offset_rad) && finite(c.trim_rate_rad_s);
    case CommandKind::kRate:
      return finite(c.trim_rate_rad_s) &&
             std::hypot(c.trim_rate_rad_s[0], c.trim_rate_rad_s[1]) <= kFastest_rad_s;
    case CommandKind::kAttitude: {
      const Quaternion& q = c.attitude.j2000_to_camera;
      const auto& rate = c.attitude.rate_rad_s;
      const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
      return finite(q) && finite(rate) && length > 0.5 && length < 2.0 &&
             std::hypot(rate[0], rate[1], rate[2]) <= kFastest_rad_s;
    }
    case CommandKind::kMode:
      return static_cast<int>(c.mode) < kGuidanceModes;
    case CommandKind::kReport:
    case CommandKind::kPing:
    case CommandKind::kTrigger:
      break;
  }
  return true;
}

}  // namespace

ClosedLoopPointing::ClosedLoopPointing(const ScriptedPointing& prediction, const PointingSpec& spec,
                                       Jitter jitter)
    : guidance_(prediction, spec.error),
      first_mode_(spec.mode),
      axes_{Actuator(spec.actuator, 0), Actuator(spec.actuator, 1), Actuator(spec.actuator, 2)},
      delay_(spec.actuator.delay),
      sensors_(spec.sensors, spec.seed),
      jitter_(std::move(jitter)),
      under_way_(kMostUnderWay) {}

ClosedLoopPointing::ClosedLoopPointing(const ScriptedPointing& prediction,
                                       const GuidanceError& error, const ActuatorSpec& actuator)
    : ClosedLoopPointing(prediction, PointingSpec{.error = error, .actuator = actuator}) {}

CameraAttitude ClosedLoopPointing::attitude(SimTime t) noexcept {
  const CameraAttitude attitude = passing(t);
  history_.add(t, trim_rad());
  const Matrix3d& axes = attitude.axes.matrix;
  if (looked_ && t > last_look_)
    last_rate_rad_s_ = turn_of(axes * last_axes_.transpose()) / engine::seconds(t - last_look_);
  looked_ = true;
  last_look_ = t;
  last_axes_ = axes;
  return attitude;
}

CameraAttitude ClosedLoopPointing::passing(SimTime t) noexcept {
  if (!begun_) begin(t);
  while (under_way_.has_due(t)) {
    const auto [due, order] = under_way_.pop();
    advance_to(std::max(due, now_));
    obey(order);
  }
  advance_to(t);

  CameraAttitude attitude = guidance_.line(t);
  Matrix3d& axes = attitude.axes.matrix;
  const TrimAngles shaken = jitter_.at(t);
  const Vector3d turn = turn_rad();
  const Vector3d unseen = turn_towards(shaken[0] + axes_[0].unseen_rad(),
                                       shaken[1] + axes_[1].unseen_rad(), axes_[2].unseen_rad());
  if (!turn.isZero(0.0)) axes = axes_turned(turn) * axes;
  if (!unseen.isZero(0.0)) axes = axes_turned(unseen) * axes;
  return attitude;
}

void ClosedLoopPointing::begin(SimTime t) noexcept {
  begun_ = true;
  now_ = t;
  for (Actuator& axis : axes_) axis.advance_to(t);
  guidance_.set_mode(first_mode_, guidance_.line(t).axes.matrix);
}

void ClosedLoopPointing::advance_to(SimTime t) noexcept {
  do {  // at the same instant too: an ideal actuator answers at once
    now_ = std::min(now_ + kStretch, t);
    for (Actuator& axis : axes_) axis.advance_to(now_);
    turn_the_short_way();
  } while (now_ < t);
}

void ClosedLoopPointing::apply(const Command& c) noexcept {
  if (c.kind == CommandKind::kReport || c.kind == CommandKind::kPing ||
      c.kind == CommandKind::kTrigger)
    return;
  if (!can_be_obeyed(c)) {
    ++refused_;
    return;
  }
  const Order order{c.kind, c.trim_offset_rad, c.trim_rate_rad_s, c.reference, c.attitude, c.mode};
  if (begun_ && delay_ == Duration{}) {
    obey(order);
  } else if (!under_way_.push(order, begun_ ? now_ + delay_ : SimTime::min())) {
    ++refused_;
  }
}

void ClosedLoopPointing::obey(const Order& order) noexcept {
  switch (order.kind) {
    case CommandKind::kTrim:
      for (std::size_t i = 0; i < 2; ++i)
        axes_[i].follow(order.offset_rad[i], order.rate_rad_s[i], order.reference);
      break;
    case CommandKind::kRate: {
      history_.add(now_, trim_rad());
      const TrimAngles from = history_.at(order.reference);
      for (std::size_t i = 0; i < 2; ++i)
        axes_[i].turn_from(from[i], order.rate_rad_s[i], order.reference);
      break;
    }
    case CommandKind::kAttitude:
      change_line([&](const Matrix3d&) { guidance_.command(order.attitude, order.reference); });
      break;
    case CommandKind::kMode:
      change_line([&](const Matrix3d& held) { guidance_.set_mode(order.mode, held); });
      break;
    case CommandKind::kReport:
    case CommandKind::kPing:
    case CommandKind::kTrigger:
      break;
  }
}

template <class Set>
void ClosedLoopPointing::change_line(Set set) noexcept {
  const SimTime soon = now_ + kInstant;
  const double instant_s = engine::seconds(kInstant);
  const Matrix3d held = axes_turned(turn_rad()) * guidance_.line(now_).axes.matrix;
  const Matrix3d held_soon =
      axes_turned(turn_rad() + instant_s * turn_rate_rad_s()) * guidance_.line(soon).axes.matrix;
  set(held);
  const Vector3d turn = turn_of(held * guidance_.line(now_).axes.matrix.transpose());
  const Vector3d turn_soon =
      turn_near(turn_of(held_soon * guidance_.line(soon).axes.matrix.transpose()), turn);
  Vector3d rate = (turn_soon - turn) / instant_s;
  // A rotation vector's rate is not quite the camera's: many lines in turn can drive it up.
  rate *= std::min(1.0, kFastestTurn_rad_s / std::max(rate.norm(), 1e-300));
  place(turn, rate);
  for (Actuator& axis : axes_) axis.follow(0.0, 0.0, now_);
  history_.clear();
}

/// A camera that is turned on and on away from its line comes back the short way.
void ClosedLoopPointing::turn_the_short_way() noexcept {
  const Vector3d turn = turn_rad();
  const double angle = turn.norm();
  // Not from pi on: after half a turn either way is as short, and it must not waver.
  if (angle < 1.5 * kPi) return;
  const Vector3d axis = turn / angle;
  const double less = std::remainder(angle, 2.0 * kPi);
  const Vector3d rate = turn_rate_rad_s();
  const Vector3d along = rate.dot(axis) * axis;
  place(less * axis, along + less / angle * (rate - along));
  history_.clear();
}

Vector3d ClosedLoopPointing::turn_rad() const noexcept {
  return turn_towards(axes_[0].angle_rad(), axes_[1].angle_rad(), axes_[2].angle_rad());
}

Vector3d ClosedLoopPointing::turn_rate_rad_s() const noexcept {
  return turn_towards(axes_[0].rate_rad_s(), axes_[1].rate_rad_s(), axes_[2].rate_rad_s());
}

void ClosedLoopPointing::place(const Vector3d& turn, const Vector3d& rate) noexcept {
  axes_[0].place(turn.y(), rate.y());
  axes_[1].place(-turn.x(), -rate.x());
  axes_[2].place(turn.z(), rate.z());
}

MeasuredAttitude ClosedLoopPointing::measured() const noexcept {
  return sensors_.read(last_axes_, last_rate_rad_s_, now_);
}

}  // namespace hil
