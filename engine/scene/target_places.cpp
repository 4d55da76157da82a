#include "engine/scene/target_places.h"

#include <array>
#include <sstream>
#include <utility>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Pose = Eigen::Isometry3d;

constexpr double kLargest_m = 10'000.0;
constexpr std::size_t kMostCopies = 10'000;

Range anywhere() { return between(-kLargest_m, kLargest_m); }

/// "x 90": an axis and an angle in degrees.
Pose turn(const ConfigTable& t, const std::string& text) {
  std::istringstream words(text);
  std::string axis;
  std::string rest;
  double angle_deg = 0;
  if (!(words >> axis >> angle_deg) || (words >> rest) || axis.size() != 1 || axis[0] < 'x' ||
      axis[0] > 'z' || !(angle_deg >= -360.0 && angle_deg <= 360.0)) {
    t.fail("turns", "must be an axis and degrees, like \"x 90\", got \"" + text + "\"");
  }
  return Pose(Eigen::AngleAxisd(angle_deg * kDegree, Vector3d::Unit(axis[0] - 'x')));
}

/// Where copies stand before all of them are turned about an axis.
std::vector<Vector3d> read_offsets_m(const ConfigTable& t) {
  const auto vector = [](const std::vector<double>& v) { return Vector3d(v[0], v[1], v[2]); };
  std::vector<Vector3d> all = {Vector3d::Zero()};
  if (t.has("at_m")) all = {vector(t.numbers("at_m", 3, anywhere()))};
  if (t.has("at_each_m")) {
    if (t.has("at_m")) t.fail("at_each_m", "and at_m are two ways to say where");
    all.clear();
    for (const auto& row : t.rows("at_each_m", 3, anywhere())) all.push_back(vector(row));
  }
  if (!t.has("grid")) return all;
  const Vector3d count = vector(t.numbers("grid", 3, between(1, 1000)));
  const Vector3d pitch_m = vector(t.numbers("pitch_m", 3, anywhere()));
  if (count != count.array().floor().matrix()) t.fail("grid", "must be three whole numbers");
  if (count.prod() * static_cast<double>(all.size()) > static_cast<double>(kMostCopies))
    t.fail("grid", "makes over ten thousand copies");
  std::vector<Vector3d> spread;
  for (const Vector3d& at : all) {
    for (int i = 0; i < count.x(); ++i)
      for (int j = 0; j < count.y(); ++j)
        for (int k = 0; k < count.z(); ++k)
          spread.emplace_back(at.x() + (i - 0.5 * (count.x() - 1.0)) * pitch_m.x(),
                              at.y() + (j - 0.5 * (count.y() - 1.0)) * pitch_m.y(),
                              at.z() + (k - 0.5 * (count.z() - 1.0)) * pitch_m.z());
  }
  return spread;
}

}  // namespace

std::vector<Pose> read_places(const ConfigTable& t) {
  Pose turned = Pose::Identity();
  for (const std::string& text : t.texts("turns")) turned = turned * turn(t, text);
  const std::vector<Vector3d> offsets_m = read_offsets_m(t);
  std::vector<Pose> about = {Pose::Identity()};
  const std::array<std::pair<const char*, Vector3d>, 3> axes = {
      {{"round_x_deg", Vector3d::UnitX()},
       {"round_y_deg", Vector3d::UnitY()},
       {"round_z_deg", Vector3d::UnitZ()}}};
  for (const auto& [key, axis] : axes) {
    if (!t.has(key)) continue;
    const std::vector<double> angles_deg = t.numbers_or_none(key, between(-360, 360));
    if (angles_deg.empty()) t.fail(key, "must have one angle or more");
    if (about.size() * angles_deg.size() * offsets_m.size() > kMostCopies)
      t.fail(key, "makes over ten thousand copies");
    std::vector<Pose> more;
    for (const Pose& pose : about)
      for (const double angle_deg : angles_deg)
        more.push_back(pose * Pose(Eigen::AngleAxisd(angle_deg * kDegree, axis)));
    about = std::move(more);
  }
  std::vector<Pose> all;
  for (const Pose& pose : about)
    for (const Vector3d& at : offsets_m)
      all.push_back(pose * Pose(Eigen::Translation3d(at)) * turned);
  return all;
}

std::vector<PlacedGroup> frames_of(const ConfigTable& t, const PlacedFrames& frames) {
  if (!t.has("frame")) return {PlacedGroup{}};
  const auto it = frames.find(t.text("frame"));
  if (it == frames.end())
    t.fail("frame", "must be the name of a frame above, got \"" + t.text("frame") + "\"");
  return it->second;
}

std::vector<PlacedGroup> read_frame(const ConfigTable& t, const PlacedFrames& frames) {
  const std::vector<Pose> places = read_places(t);
  const std::vector<std::string> groups = t.texts("groups");
  if (!groups.empty() && groups.size() != places.size())
    t.fail("groups", "must be as many as its places, " + std::to_string(places.size()) + ", got " +
                         std::to_string(groups.size()));
  std::vector<PlacedGroup> all;
  for (const PlacedGroup& outer : frames_of(t, frames))
    for (std::size_t i = 0; i < places.size(); ++i)
      all.push_back({outer.pose * places[i], groups.empty() ? outer.group : groups[i]});
  return all;
}

}  // namespace engine
