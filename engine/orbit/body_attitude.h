#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/orbit/aem.h"
#include "engine/orbit/attitude.h"
#include "engine/orbit/tumbling_body.h"

namespace engine {

/// How a body is turned as time goes on.
enum class AttitudeKind : std::uint8_t {
  kNadir,     ///< held to the orbital frame, with offsets
  kInertial,  ///< held to the stars
  kSpin,      ///< turned evenly about an axis of its own
  kTumbling,  ///< a rigid body that nothing turns
  kFile,      ///< as a CCSDS file has it
};

/// kInertial, kSpin and kTumbling start from an attitude at the epoch: a quaternion (body
/// coordinates are q v q*, v those of J2000), or offsets from J2000's axes.
struct AttitudeSpec {
  AttitudeKind kind = AttitudeKind::kNadir;
  EulerOffsets offsets;  ///< from the orbital frame; for the other kinds from J2000
  std::optional<Eigen::Quaterniond> body_from_j2000;      ///< in the offsets' place
  Eigen::Vector3d spin_axis = Eigen::Vector3d::UnitX();   ///< of the body, unit
  double spin_rate_rad_s = 0;                             ///< about it
  double spin_phase_rad = 0;                              ///< turned by the epoch
  Eigen::Vector3d inertia = Eigen::Vector3d(1, 2, 3);     ///< about the body's axes; any unit
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d(0, 0, 0);  ///< in body axes, at the epoch
  std::vector<AemSegment> segments;                       ///< of kFile
  std::string where;  ///< the place in the scenario that chooses
};

/// `attitude`, and what belongs to it. Throws ConfigError.
[[nodiscard]] AttitudeSpec read_attitude(const ConfigTable& table);
/// Throws ConfigError when a file has nothing for a part of `wanted`.
void need_span(const AttitudeSpec& spec, const EpochSpan& wanted);

/// A body's axes as a function of time and of the orbit that it is upright in.
/// Thread: any. Loop-safe.
class BodyAttitude {
 public:
  /// By default held to the orbit.
  BodyAttitude(const AttitudeSpec& spec = {}, Epoch epoch = {});

  [[nodiscard]] Rotation<BodyFrame, J2000> axes(Epoch t, const OrbitState& upright) const noexcept;
  /// The rule had no answer of its own: moves_straight().
  [[nodiscard]] bool is_fallback(const OrbitState& upright) const noexcept {
    return spec_.kind == AttitudeKind::kNadir && moves_straight(upright);
  }

 private:
  AttitudeSpec spec_;
  Epoch epoch_;
  Rotation<BodyFrame, J2000> at_epoch_;  ///< of those that start from there
  std::optional<TumblingBody> tumbling_;
};

}  // namespace engine
