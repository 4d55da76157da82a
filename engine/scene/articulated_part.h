#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "engine/scene/companion.h"

namespace engine {

/// What a part turns its front to.
enum class PartFollows : std::uint8_t { kNothing, kSun, kEarth, kCamera, kBody };

/// A rigid group of a body's mesh that turns about a hinge: <body>.parts.<name> of a scenario.
///
/// With one axis it turns its front as near as it comes to what it follows, and by `angle_rad`
/// more. With a second one, at right angles to the first and to the front and carried by it, the
/// front points there, as an antenna's gimbal does. All vectors are in the body's axes, with the
/// part as the mesh has it.
/// Leaves out: that drives are slow; that a part turns while the shutter is open.
struct PartSpec {
  std::string name;
  std::string where;                ///< its place in the scenario
  std::size_t owner = 0;            ///< the body that it belongs to, as BodyNumber
  std::vector<std::string> groups;  ///< of the body's mesh
  Eigen::Vector3d hinge_m = Eigen::Vector3d::Zero();  ///< a place on all its axes
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();    ///< unit
  std::optional<Eigen::Vector3d> second_axis;         ///< unit
  Eigen::Vector3d front = Eigen::Vector3d::UnitZ();   ///< unit; not along the axis
  PartFollows follows = PartFollows::kNothing;
  std::size_t followed = 0;  ///< of kBody
  double angle_rad = 0;
  double rate_rad_s = 0;  ///< of a part that follows nothing, from angle_rad at the epoch
  using Limits = std::array<double, 2>;
  std::optional<Limits> limits_rad;         ///< of the angle about the axis
  std::optional<Limits> second_limits_rad;  ///< and about the second one
};

/// Reads target.parts.<name> and companions.<name>.parts.<name>, kMostParts at most; the target's
/// come first, then those of each companion in its turn.
[[nodiscard]] std::vector<PartSpec> read_parts(const ConfigReader& config,
                                               const std::vector<CompanionSpec>& companions);

/// How a part stands.
struct PartPose {
  Eigen::Matrix3d from_owner = Eigen::Matrix3d::Identity();  ///< takes the body's axes to its own
  double angle_rad = 0;
  double second_angle_rad = 0;
  bool at_limit = false;  ///< a limit keeps it from its place
};

/// Where a part should stand. Thread: any. Loop-safe.
class ArticulatedPart {
 public:
  explicit ArticulatedPart(PartSpec spec);

  [[nodiscard]] const PartSpec& spec() const noexcept { return spec_; }
  /// `toward`: what it follows, in the body's axes, of any length. When that lies along the axis,
  /// or is no direction at all, the part stands at its angle_rad.
  [[nodiscard]] PartPose pose(const Eigen::Vector3d& toward, Duration since_epoch) const noexcept;

 private:
  PartSpec spec_;
};

}  // namespace engine
