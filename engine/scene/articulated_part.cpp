#include "engine/scene/articulated_part.h"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "engine/core/constants.h"
#include "engine/scene/body_number.h"

namespace engine {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// A direction nearer to the axis than this says nothing about an angle round it.
constexpr double kAlongAxis = 1e-6;
constexpr double kRounding_rad = 1e-9;
// Axes that a user has written with a few decimals count as upright.
constexpr double kUpright = 1e-3;

/// About the axis, from one direction to the other, as seen along it; 0 where one has no angle.
double angle_about(const Vector3d& axis, const Vector3d& from, const Vector3d& to) noexcept {
  const Vector3d flat_from = from - axis.dot(from) * axis;
  const Vector3d flat_to = to - axis.dot(to) * axis;
  if (!(flat_from.norm() > kAlongAxis && flat_to.norm() > kAlongAxis)) return 0.0;
  return std::atan2(axis.dot(flat_from.cross(flat_to)), flat_from.dot(flat_to));
}

struct Limited {
  double angle_rad = 0;
  bool at_limit = false;
};

/// The angle itself, whole turns added if need be, or the end of its range that is nearest.
Limited limited(double angle_rad, const std::optional<PartSpec::Limits>& limits) noexcept {
  if (!limits) return {std::remainder(angle_rad, 2.0 * kPi), false};
  const auto& [low, high] = *limits;
  const double from_low = angle_rad - low;
  const double turned = low + from_low - 2.0 * kPi * std::floor(from_low / (2.0 * kPi));
  if (turned <= high) return {turned, false};
  // Rounding must not take what stands at its first place for the last but one of a turn later.
  if (low + 2.0 * kPi - turned < kRounding_rad) return {low, false};
  return {turned - high < low + 2.0 * kPi - turned ? high : low, true};
}

Vector3d read_direction(const ConfigTable& table, const std::string& key) {
  const std::vector<double> v = table.numbers(key, 3, between(-1e9, 1e9));
  const Vector3d direction(v[0], v[1], v[2]);
  if (!(direction.norm() > 0.0)) table.fail(key, "must have a direction, got [0, 0, 0]");
  return direction.normalized();
}

std::optional<PartSpec::Limits> read_limits(const ConfigTable& table, const std::string& key) {
  if (!table.has(key)) return std::nullopt;
  const std::vector<double> v = table.numbers(key, 2, between(-360.0, 360.0));
  if (!(v[0] <= v[1]) || v[1] - v[0] > 360.0)
    table.fail(key, "must be [least, most], a whole turn apart at most");
  return PartSpec::Limits{v[0] * kDegree, v[1] * kDegree};
}

std::vector<std::string> names_of(const std::vector<CompanionSpec>& companions) {
  std::vector<std::string> names;
  for (const CompanionSpec& companion : companions) names.push_back(companion.name);
  return names;
}

void read_follows(const ConfigTable& table, const std::vector<CompanionSpec>& companions,
                  PartSpec& spec) {
  if (!table.has("follows")) {
    spec.rate_rad_s = table.number_or("rate_deg_s", 0.0, between(-36000.0, 36000.0)) * kDegree;
    return;
  }
  const std::string word = table.text("follows");
  if (word == "sun") {
    spec.follows = PartFollows::kSun;
  } else if (word == "earth") {
    spec.follows = PartFollows::kEarth;
  } else if (word == "camera") {
    spec.follows = PartFollows::kCamera;
  } else if (const auto body = body_number(word, names_of(companions)); !body) {
    table.fail("follows",
               "must be \"sun\", \"earth\", \"camera\", \"target\" or the name of a companion, "
               "got \"" +
                   word + "\"");
  } else if (*body == spec.owner) {
    table.fail("follows", "must be another body than its own, got \"" + word + "\"");
  } else {
    spec.follows = PartFollows::kBody;
    spec.followed = *body;
  }
  spec.front = read_direction(table, "front");
  if (spec.front.cross(spec.axis).norm() < kUpright && !spec.second_axis)
    table.fail("front", "must not lie along the axis: no turn would change where it points");
}

void read_second_axis(const ConfigTable& table, PartSpec& spec) {
  if (!table.has("second_axis")) return;
  const Vector3d axis = read_direction(table, "second_axis");
  if (std::abs(axis.dot(spec.axis)) > kUpright)
    table.fail("second_axis", "must be at right angles to axis");
  // Made exactly so: the gimbal's angles count on it.
  spec.second_axis = (axis - axis.dot(spec.axis) * spec.axis).normalized();
}

PartSpec read_part(const ConfigReader& config, const std::string& path, const std::string& name,
                   std::size_t owner, const std::vector<CompanionSpec>& companions) {
  const ConfigTable table = config.table(path + "." + name);
  PartSpec spec;
  spec.name = name;
  spec.owner = owner;
  spec.where = table.where("groups");
  spec.groups = table.texts("groups");
  if (spec.groups.empty())
    config.table(path).fail(name, "must have groups: names of groups of the mesh");
  if (table.has("hinge_m")) {
    const std::vector<double> hinge = table.numbers("hinge_m", 3, between(-1e4, 1e4));
    spec.hinge_m = {hinge[0], hinge[1], hinge[2]};
  }
  spec.axis = read_direction(table, "axis");
  read_second_axis(table, spec);
  read_follows(table, companions, spec);
  if (spec.second_axis) {
    if (spec.follows == PartFollows::kNothing)
      table.fail("second_axis", "needs follows: what the part is to point at");
    if (std::abs(spec.second_axis->dot(spec.front)) > kUpright)
      table.fail("second_axis", "must be at right angles to front");
    spec.front = (spec.front - spec.front.dot(*spec.second_axis) * *spec.second_axis).normalized();
    spec.second_limits_rad = read_limits(table, "second_range_deg");
  }
  spec.angle_rad = table.number_or("angle_deg", 0.0, between(-360.0, 360.0)) * kDegree;
  spec.limits_rad = read_limits(table, "range_deg");
  return spec;
}

}  // namespace

std::vector<PartSpec> read_parts(const ConfigReader& config,
                                 const std::vector<CompanionSpec>& companions) {
  std::vector<PartSpec> parts;
  const auto add_those_of = [&](const std::string& body, std::size_t owner) {
    const std::string path = body + ".parts";
    for (const std::string& name : config.tables_below(path)) {
      if (parts.size() == kMostParts) {
        config.table(path).fail(
            name, "is one too many: there may be " + std::to_string(kMostParts) + " parts in all");
      }
      parts.push_back(read_part(config, path, name, owner, companions));
    }
  };
  add_those_of("target", 0);
  for (std::size_t i = 0; i < companions.size(); ++i)
    add_those_of("companions." + companions[i].name, i + 1);
  return parts;
}

ArticulatedPart::ArticulatedPart(PartSpec spec) : spec_(std::move(spec)) {}

PartPose ArticulatedPart::pose(const Vector3d& toward, Duration since_epoch) const noexcept {
  const double length = toward.norm();
  const bool known = std::isfinite(length) && length > 0.0;
  const Vector3d there = known ? Vector3d(toward / length) : spec_.front;
  double angle = spec_.angle_rad;
  if (spec_.follows == PartFollows::kNothing) {
    angle += spec_.rate_rad_s * seconds(since_epoch);
  } else if (!spec_.second_axis) {
    angle += angle_about(spec_.axis, spec_.front, there);
  } else {
    // The first axis brings what is followed into the plane that the second one turns the front in,
    // on the side that the front rests on.
    const Vector3d& a = spec_.axis;
    const Vector3d ahead = a.cross(*spec_.second_axis);
    const double side = spec_.front.dot(ahead) < -kAlongAxis ? -1.0 : 1.0;
    angle += angle_about(a, side * ahead, there);
  }
  const Limited first = limited(angle, spec_.limits_rad);
  const Matrix3d turn = AngleAxisd(first.angle_rad, spec_.axis).toRotationMatrix();
  PartPose pose{turn.transpose(), first.angle_rad, 0.0, first.at_limit};
  if (!spec_.second_axis) return pose;
  const Limited second =
      limited(angle_about(*spec_.second_axis, spec_.front, turn.transpose() * there),
              spec_.second_limits_rad);
  pose.second_angle_rad = second.angle_rad;
  pose.at_limit = pose.at_limit || second.at_limit;
  pose.from_owner =
      AngleAxisd(-second.angle_rad, *spec_.second_axis).toRotationMatrix() * pose.from_owner;
  return pose;
}

}  // namespace engine
