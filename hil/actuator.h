#pragma once

#include <array>

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/core/time.h"

namespace hil {

/// Axes x (u), y (v) and roll about the boresight, all alike but for bias and drift.
struct ActuatorSpec {
  double natural_frequency_hz = 5;
  double damping = 0.7;
  double rate_limit_rad_s = 2e-3;
  double acceleration_limit_rad_s2 = 10e-3;
  double angle_limit_rad = engine::kPi;  ///< how far commands reach, either way; pi: no stop there
  double command_step_rad = 0;  ///< offsets are rounded to multiples of it; 0: they are not
  engine::Duration delay{};     ///< from a command's arrival to its effect
  bool ideal = false;           ///< there at once: no dynamics, no limit but the angle's
  /// By how much the true angle differs from what the actuator's own sensor says; x, y, roll.
  std::array<double, 3> bias_rad{};
  std::array<double, 3> drift_rad_s{};
};
[[nodiscard]] ActuatorSpec read_actuator(const engine::ConfigTable& table);

/// One axis of a pointing stage: second order, led by a reference that moves at a constant rate.
///
/// Between the limits the closed form of x'' = w^2 (r - x) + 2 z w (r' - x') is stepped exactly;
/// where a limit holds, the acceleration is constant over each step. Steps of 1 ms, shorter for a
/// stiff actuator. The acceleration never exceeds its limit, and never takes the rate above its
/// own: one that place() put there comes down as fast as it may. Far from the reference the rate
/// asked for is what three quarters of the acceleration limit can brake, so a long way does not end
/// in an overshoot. The stop at the angle limit is hard: there the rate ends at once.
/// Leaves out: friction, backlash, structural modes. The delay is the pointing's business.
/// Thread: loop. Loop-safe.
class Actuator {
 public:
  explicit Actuator(const ActuatorSpec& spec, std::size_t axis = 0) noexcept;

  /// From now on: offset + rate * (t - reference). Ignored unless finite.
  void follow(double offset_rad, double rate_rad_s, engine::SimTime reference) noexcept;
  /// The same, but it stays at the offset until `reference`, and the offset is not rounded.
  void turn_from(double offset_rad, double rate_rad_s, engine::SimTime reference) noexcept;
  /// The same motion, seen from another line. May lie beyond the angle limit: it comes in from
  /// there.
  void place(double angle_rad, double rate_rad_s) noexcept;
  /// Pre: `t` never decreases.
  void advance_to(engine::SimTime t) noexcept;

  [[nodiscard]] double angle_rad() const noexcept { return angle_rad_; }
  [[nodiscard]] double rate_rad_s() const noexcept { return rate_rad_s_; }
  /// Bias and drift since the first advance_to().
  [[nodiscard]] double unseen_rad() const noexcept {
    return bias_rad_ + drift_rad_s_ * engine::seconds(now_ - start_);
  }

 private:
  /// exp(A h): takes error and error rate one step on.
  struct Transition {
    double h_s = 0;
    double ee = 1, ev = 0, ve = 0, vv = 1;
  };
  struct Wanted {
    double angle_rad = 0;
    double rate_rad_s = 0;
  };

  [[nodiscard]] Transition transition(double h_s) const noexcept;
  [[nodiscard]] Wanted wanted(double after_reference_s) const noexcept;
  void step(engine::Duration d) noexcept;
  void substep(const Wanted& wanted, const Transition& next) noexcept;
  [[nodiscard]] bool step_between_limits(const Wanted& wanted, const Transition& next) noexcept;
  void step_at_limits(const Wanted& wanted, const Transition& next) noexcept;

  ActuatorSpec spec_;
  double bias_rad_;
  double drift_rad_s_;
  double stiffness_1_s2_;
  double damping_1_s_;
  double braking_rad_s2_;  // far away
  double braking_from_rad_;
  double near_rad_;  // the closed form holds as far as this from the reference
  int substeps_;
  Transition whole_;

  double angle_rad_ = 0;
  double rate_rad_s_ = 0;
  engine::SimTime now_{};
  engine::SimTime start_{};
  bool started_ = false;
  Wanted target_;
  engine::SimTime reference_{};
  bool waits_for_reference_ = false;
};

}  // namespace hil
