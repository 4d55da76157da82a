#include "hil/actuator.h"

#include <algorithm>

#include "engine/core/constants.h"

namespace hil {

using engine::Duration;
using engine::SimTime;

ActuatorSpec read_actuator(const engine::ConfigTable& table) {
  ActuatorSpec spec;
  spec.natural_frequency_hz = table.number("natural_frequency_hz", engine::between(0.01, 100.0));
  spec.damping = table.number("damping", engine::between(0.01, 10.0));
  spec.rate_limit_rad_s = table.number("rate_limit_mrad_s", engine::positive()) * 1e-3;
  spec.acceleration_limit_rad_s2 =
      table.number("acceleration_limit_mrad_s2", engine::positive()) * 1e-3;
  return spec;
}

Actuator::Actuator(const ActuatorSpec& spec) noexcept : spec_(spec) {
  const double w = 2.0 * engine::kPi * spec.natural_frequency_hz;
  stiffness_1_s2_ = w * w;
  damping_1_s_ = 2.0 * spec.damping * w;
}

void Actuator::follow(double offset_rad, double rate_rad_s, SimTime reference) noexcept {
  target_rad_ = offset_rad;
  target_rate_rad_s_ = rate_rad_s;
  target_time_ = reference;
}

void Actuator::advance_to(SimTime t) noexcept {
  constexpr Duration kStep{1'000'000};
  if (!started_) {
    now_ = t;
    started_ = true;
  }
  while (t - now_ > kStep) step(kStep);
  if (t > now_) step(t - now_);
}

void Actuator::step(Duration d) noexcept {
  const double dt = engine::seconds(d);
  // No command, however absurd, asks for more than half a turn: what follows stays finite.
  const double wanted = std::clamp(
      target_rad_ + target_rate_rad_s_ * (engine::seconds(now_) - engine::seconds(target_time_)),
      -engine::kPi, engine::kPi);
  now_ += d;
  const double acceleration =
      stiffness_1_s2_ * (wanted - angle_rad_) + damping_1_s_ * (target_rate_rad_s_ - rate_rad_s_);
  const double most = spec_.acceleration_limit_rad_s2;
  rate_rad_s_ += std::clamp(acceleration, -most, most) * dt;
  rate_rad_s_ = std::clamp(rate_rad_s_, -spec_.rate_limit_rad_s, spec_.rate_limit_rad_s);
  angle_rad_ += rate_rad_s_ * dt;
}

}  // namespace hil
