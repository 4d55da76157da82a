#include "hil/actuator.h"

#include <algorithm>
#include <cmath>

namespace hil {

using engine::Duration;
using engine::kPi;
using engine::seconds;
using engine::SimTime;

namespace {

constexpr Duration kStep{1'000'000};
// Of a step, in units of the faster of the two time constants.
constexpr double kLongestSubstep = 0.1;
// Inside a substep the closed form may exceed its ends: by (w h)^2 / 8 of the acceleration, and
// twice that of the rate limit, where w h is at most a tenth.
constexpr double kInside = 0.995;
constexpr double kBrakingShare = 0.75;
// Two turns a second: what an ideal actuator is asked for at most.
constexpr double kFastest_rad_s = 4.0 * kPi;

}  // namespace

ActuatorSpec read_actuator(const engine::ConfigTable& table) {
  ActuatorSpec spec;
  spec.natural_frequency_hz = table.number("natural_frequency_hz", engine::between(0.01, 100.0));
  spec.damping = table.number("damping", engine::between(0.01, 10.0));
  spec.rate_limit_rad_s = table.number("rate_limit_mrad_s", engine::positive()) * 1e-3;
  spec.acceleration_limit_rad_s2 =
      table.number("acceleration_limit_mrad_s2", engine::positive()) * 1e-3;
  spec.ideal =
      table.choice_or<bool>("response", "second-order", {{"second-order", false}, {"ideal", true}});
  spec.delay =
      engine::from_seconds(table.number_or("delay_ms", 0.0, engine::between(0.0, 10'000.0)) * 1e-3);
  engine::Range angle = engine::positive();
  angle.high = kPi * 1e3;
  if (table.has("angle_limit_mrad"))
    spec.angle_limit_rad = table.number("angle_limit_mrad", angle) * 1e-3;
  spec.command_step_rad =
      table.number_or("command_step_urad", 0.0, engine::between(0.0, 1e5)) * 1e-6;
  const engine::Range error = engine::between(-1e5, 1e5);
  spec.bias_rad = {table.number_or("bias_x_urad", 0.0, error) * 1e-6,
                   table.number_or("bias_y_urad", 0.0, error) * 1e-6,
                   table.number_or("bias_roll_urad", 0.0, error) * 1e-6};
  spec.drift_rad_s = {table.number_or("drift_x_urad_s", 0.0, error) * 1e-6,
                      table.number_or("drift_y_urad_s", 0.0, error) * 1e-6,
                      table.number_or("drift_roll_urad_s", 0.0, error) * 1e-6};
  return spec;
}

Actuator::Actuator(const ActuatorSpec& spec, std::size_t axis) noexcept
    : spec_(spec), bias_rad_(spec.bias_rad[axis]), drift_rad_s_(spec.drift_rad_s[axis]) {
  const double w = 2.0 * kPi * spec.natural_frequency_hz;
  const double z = spec.damping;
  stiffness_1_s2_ = w * w;
  damping_1_s_ = 2.0 * z * w;
  const double longest_s = kLongestSubstep / (w * std::max(1.0, 2.0 * z));
  substeps_ = std::max(1, static_cast<int>(std::ceil(seconds(kStep) / longest_s)));
  whole_ = transition(seconds(kStep) / substeps_);
  // Braking starts so much early that a step which asks for no more than the acceleration limit
  // still lies where the closed form holds.
  braking_rad_s2_ = kBrakingShare * spec.acceleration_limit_rad_s2;
  braking_from_rad_ = spec.acceleration_limit_rad_s2 / stiffness_1_s2_ *
                      std::max(1.0, 1.0 / (8.0 * kBrakingShare * z * z));
  const double k = stiffness_1_s2_ / damping_1_s_;
  near_rad_ = (braking_rad_s2_ + std::sqrt(braking_rad_s2_ * braking_rad_s2_ +
                                           2.0 * braking_rad_s2_ * k * k * braking_from_rad_)) /
              (k * k);
}

void Actuator::follow(double offset_rad, double rate_rad_s, SimTime reference) noexcept {
  if (!std::isfinite(offset_rad) || !std::isfinite(rate_rad_s)) return;
  target_ = {offset_rad, rate_rad_s};
  const double step = spec_.command_step_rad;
  if (step > 0.0) target_.angle_rad = std::round(std::clamp(offset_rad, -kPi, kPi) / step) * step;
  reference_ = reference;
  waits_for_reference_ = false;
}

void Actuator::turn_from(double offset_rad, double rate_rad_s, SimTime reference) noexcept {
  if (!std::isfinite(offset_rad) || !std::isfinite(rate_rad_s)) return;
  target_ = {offset_rad, rate_rad_s};
  reference_ = reference;
  waits_for_reference_ = true;
}

void Actuator::place(double angle_rad, double rate_rad_s) noexcept {
  angle_rad_ = angle_rad;
  rate_rad_s_ = rate_rad_s;
}

void Actuator::advance_to(SimTime t) noexcept {
  if (!started_) {
    now_ = start_ = t;
    started_ = true;
  }
  if (spec_.ideal) {
    now_ = t;
    const Wanted w = wanted(seconds(now_) - seconds(reference_));
    place(w.angle_rad, std::clamp(w.rate_rad_s, -kFastest_rad_s, kFastest_rad_s));
    return;
  }
  while (t - now_ > kStep) step(kStep);
  if (t > now_) step(t - now_);
}

/// No command, however absurd, asks for more than the angle limit: what follows stays finite.
Actuator::Wanted Actuator::wanted(double after_reference_s) const noexcept {
  if (waits_for_reference_ && after_reference_s < 0.0)
    return {std::clamp(target_.angle_rad, -spec_.angle_limit_rad, spec_.angle_limit_rad), 0.0};
  const double angle = target_.angle_rad + target_.rate_rad_s * after_reference_s;
  const double reached = std::clamp(angle, -spec_.angle_limit_rad, spec_.angle_limit_rad);
  return {reached, reached == angle ? target_.rate_rad_s : 0.0};
}

Actuator::Transition Actuator::transition(double h_s) const noexcept {
  const double decay_1_s = 0.5 * damping_1_s_;
  const double square = stiffness_1_s2_ - decay_1_s * decay_1_s;
  const double root = std::sqrt(std::abs(square));
  double c = 1.0;
  double s = h_s;
  if (root * h_s > 1e-8) {
    c = square > 0.0 ? std::cos(root * h_s) : std::cosh(root * h_s);
    s = (square > 0.0 ? std::sin(root * h_s) : std::sinh(root * h_s)) / root;
  }
  const double left = std::exp(-decay_1_s * h_s);
  return {h_s, left * (c + decay_1_s * s), left * s, -left * stiffness_1_s2_ * s,
          left * (c - decay_1_s * s)};
}

void Actuator::step(Duration d) noexcept {
  const Transition next = d == kStep ? whole_ : transition(seconds(d) / substeps_);
  const double begin_s = seconds(now_) - seconds(reference_);
  for (int i = 0; i < substeps_; ++i) substep(wanted(begin_s + i * next.h_s), next);
  now_ += d;
}

void Actuator::substep(const Wanted& wanted, const Transition& next) noexcept {
  const double before_rad = angle_rad_;
  const double most = spec_.rate_limit_rad_s;
  const Wanted w{wanted.angle_rad, std::clamp(wanted.rate_rad_s, -most, most)};
  if (!step_between_limits(w, next)) step_at_limits(w, next);
  const double limit = spec_.angle_limit_rad;
  // A limit of half a turn is none: what turns about all the way has no stop to run into.
  if (limit < kPi && std::abs(angle_rad_) > limit && std::abs(before_rad) <= limit)
    place(std::copysign(limit, angle_rad_), 0.0);
}

bool Actuator::step_between_limits(const Wanted& w, const Transition& next) noexcept {
  const double e0 = angle_rad_ - w.angle_rad;
  const double v0 = rate_rad_s_ - w.rate_rad_s;
  const double e1 = next.ee * e0 + next.ev * v0;
  const double v1 = next.ve * e0 + next.vv * v0;
  const double rate1 = v1 + w.rate_rad_s;
  const double hardest = std::max(std::abs(stiffness_1_s2_ * e0 + damping_1_s_ * v0),
                                  std::abs(stiffness_1_s2_ * e1 + damping_1_s_ * v1));
  if (std::max(std::abs(e0), std::abs(e1)) > near_rad_ ||
      hardest > kInside * spec_.acceleration_limit_rad_s2 ||
      std::max(std::abs(rate_rad_s_), std::abs(rate1)) > kInside * spec_.rate_limit_rad_s)
    return false;
  angle_rad_ = w.angle_rad + w.rate_rad_s * next.h_s + e1;
  rate_rad_s_ = rate1;
  return true;
}

void Actuator::step_at_limits(const Wanted& w, const Transition& next) noexcept {
  const double e = angle_rad_ - w.angle_rad;
  const double v = rate_rad_s_ - w.rate_rad_s;
  double acceleration = (next.ve * e + next.vv * v - v) / next.h_s;  // the closed form's mean
  if (std::abs(e) > near_rad_) {
    const double braked = std::sqrt(2.0 * braking_rad_s2_ * (std::abs(e) + braking_from_rad_));
    acceleration = damping_1_s_ * (-std::copysign(braked, e) - v);
  }
  const double hardest = spec_.acceleration_limit_rad_s2;
  const double change = hardest * next.h_s;
  const double before = rate_rad_s_;
  rate_rad_s_ += std::clamp(acceleration, -hardest, hardest) * next.h_s;
  const double most = spec_.rate_limit_rad_s;
  rate_rad_s_ =
      std::clamp(rate_rad_s_, std::min(-most, before + change), std::max(most, before - change));
  angle_rad_ += 0.5 * (before + rate_rad_s_) * next.h_s;
}

}  // namespace hil
