#pragma once

#include "hil/actuator.h"
#include "hil/angle_history.h"
#include "hil/attitude_sensors.h"
#include "hil/delay_line.h"
#include "hil/guidance.h"
#include "hil/jitter.h"

namespace hil {

/// A camera that obeys, but for the prediction that it follows.
struct PointingSpec {
  GuidanceMode mode = GuidanceMode::kPredictedTarget;  ///< inertial: where the target is at first
  GuidanceError error{};
  ActuatorSpec actuator{};
  SensorSpec sensors{};
  std::uint64_t seed = 0;
};

/// Follows guidance's line, wrongly, and lets commands trim it, turn it and change it, through an
/// actuator of three axes.
///
/// attitude = vibration and unseen bias * the actuator's turn * guidance's line. The line stays
/// outside the actuator: its own motion has no limits. A mode or attitude command sets another
/// line, and the actuator's turn becomes what is between the two, rate included: the camera's
/// attitude goes on without a jump or a kink, and the actuator drives the turn to zero within its
/// limits, axis by axis. Trims are relative to the line and end with it; they do not roll. A rate
/// command starts from where the actuator was at its reference time, sixteen frames back at most;
/// until a reference to come it holds.
/// An attitude command also sets the commanded mode; inertial keeps the attitude of its instant.
///
/// The gyro's true rate is the mean between the last two attitude() calls at different times,
/// passing() ones apart: in the frame loop, from the opening of the shutter to mid-exposure.
/// Thread: loop. Loop-safe once built.
class ClosedLoopPointing final : public PointingSource {
 public:
  ClosedLoopPointing(const ScriptedPointing& prediction, const PointingSpec& spec,
                     Jitter jitter = {});
  ClosedLoopPointing(const ScriptedPointing& prediction, const GuidanceError& error,
                     const ActuatorSpec& actuator);

  [[nodiscard]] engine::CameraAttitude attitude(engine::SimTime t) noexcept override;
  [[nodiscard]] engine::CameraAttitude passing(engine::SimTime t) noexcept override;
  /// Obeyed after the actuator's delay. Reports, pings and triggers change nothing; what is not
  /// finite or turns faster than two pi a second is refused; a trim replaces the one before.
  void apply(const Command& command) noexcept override;
  [[nodiscard]] TrimAngles trim_rad() const noexcept override {
    return {axes_[0].angle_rad(), axes_[1].angle_rad()};
  }
  [[nodiscard]] MeasuredAttitude measured() const noexcept override;

  [[nodiscard]] GuidanceMode mode() const noexcept { return guidance_.mode(); }
  /// Commands that were refused, or lost because too many were under way.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  /// The part of a command that steers.
  struct Order {
    CommandKind kind = CommandKind::kReport;
    TrimAngles offset_rad{};
    TrimAngles rate_rad_s{};
    engine::SimTime reference{};
    MeasuredAttitude attitude;
    GuidanceMode mode = GuidanceMode::kPredictedTarget;
  };

  void begin(engine::SimTime t) noexcept;
  void advance_to(engine::SimTime t) noexcept;
  void obey(const Order& order) noexcept;
  /// `set` changes guidance's line; the camera goes on as it was.
  template <class Set>
  void change_line(Set set) noexcept;
  void turn_the_short_way() noexcept;
  [[nodiscard]] Eigen::Vector3d turn_rad() const noexcept;
  [[nodiscard]] Eigen::Vector3d turn_rate_rad_s() const noexcept;
  void place(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& rate_rad_s) noexcept;

  Guidance guidance_;
  GuidanceMode first_mode_;
  std::array<Actuator, 3> axes_;  // x (u), y (v), roll
  engine::Duration delay_;
  AttitudeSensors sensors_;
  Jitter jitter_;
  DelayLine<Order> under_way_;
  AngleHistory history_;
  std::uint64_t refused_ = 0;

  bool begun_ = false;
  engine::SimTime now_{};
  bool looked_ = false;
  engine::SimTime last_look_{};
  Eigen::Matrix3d last_axes_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d last_rate_rad_s_ = Eigen::Vector3d::Zero();
};

}  // namespace hil
