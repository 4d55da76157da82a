#include "engine/scene/described_target.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/scene/built_in_targets.h"
#include "engine/scene/crinkle.h"
#include "engine/scene/sdf_mesher.h"
#include "engine/scene/target_builder.h"
#include "engine/scene/target_places.h"
#include "engine/scene/target_solids.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Pose = Eigen::Isometry3d;

constexpr std::size_t kMostTriangles = 2'000'000;
constexpr double kLargest_m = 10'000.0;
constexpr int kSegments = 72;
constexpr int kRodSegments = 12;
constexpr int kDishSteps = 6;
constexpr double kMostSegments = 3600;

Range length() {
  Range r = positive();
  r.high = kLargest_m;
  return r;
}

class Target {
 public:
  Target(const std::string& text, const std::string& name, std::vector<std::string>* notes)
      : config_(ConfigReader::from_text(text, name)), notes_(notes) {}
  [[nodiscard]] GroupedMesh build();

 private:
  void read_part(const std::string& name);
  void shape_part(const ConfigTable& t, const std::string& shape, const Pose& pose);
  void revolve_part(const ConfigTable& t, const std::string& shape, const Pose& pose);
  [[nodiscard]] TargetBuilder::Sweep read_sweep(const ConfigTable& t, int segments) const;
  [[nodiscard]] const Mesh& meshed_part(const ConfigTable& t, const std::string& shape);

  ConfigReader config_;
  std::vector<std::string>* notes_;
  TargetBuilder builder_;
  std::map<std::string, std::vector<PlacedGroup>> frames_;
  std::map<std::string, Solid> solids_;
  Mesh meshed_;  ///< of the part that is being read
};

TargetBuilder::Sweep Target::read_sweep(const ConfigTable& t, int segments) const {
  TargetBuilder::Sweep sweep;
  sweep.segments = static_cast<int>(t.integer_or("segments", segments, between(3, kMostSegments)));
  if (!t.has("facets")) return sweep;
  sweep.part = {t.number_or("middle_deg", 0.0, between(-360, 360)) * kDegree,
                static_cast<int>(t.integer("facets", between(1, sweep.segments - 1)))};
  return sweep;
}

void Target::revolve_part(const ConfigTable& t, const std::string& shape, const Pose& pose) {
  const auto ring = [](const std::vector<double>& row) {
    return TargetBuilder::Ring{row[0], row[1]};
  };
  if (shape == "band") {
    const auto x_m = t.numbers("x_m", 2, between(-kLargest_m, kLargest_m));
    const auto radius_m = t.numbers("radius_m", 2, length());
    if (x_m[1] <= x_m[0]) t.fail("x_m", "must rise");
    if (radius_m[1] <= radius_m[0]) t.fail("radius_m", "must rise");
    return builder_.band(pose, {x_m[0], radius_m[0]}, {x_m[1], radius_m[1]},
                         read_sweep(t, kSegments));
  }
  if (shape == "dish") {
    const double depth_m = t.number("depth_m", length());
    const double radius_m = t.number("radius_m", length());
    const double thickness_m = t.number("thickness_m", length());
    std::vector<TargetBuilder::Ring> outline;
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i <= kDishSteps; ++i) {
        const double s = static_cast<double>(side == 0 ? i : kDishSteps - i) / kDishSteps;
        outline.push_back({(side == 0 ? 0.0 : thickness_m) + depth_m * s * s, radius_m * s});
      }
    }
    return builder_.revolve(pose, outline, read_sweep(t, kSegments / 2));
  }
  std::vector<TargetBuilder::Ring> outline;
  for (const auto& row : t.rows("outline_m", 2, between(-kLargest_m, kLargest_m))) {
    if (row[1] < 0.0) t.fail("outline_m", "must have pairs of x and a radius >= 0");
    outline.push_back(ring(row));
  }
  if (outline.size() < 2) t.fail("outline_m", "must have two places or more");
  builder_.revolve(pose, outline, read_sweep(t, kSegments));
}

/// A shape of the mesher's, once for all its copies.
const Mesh& Target::meshed_part(const ConfigTable& t, const std::string& shape) {
  if (!meshed_.triangles.empty()) return meshed_;
  const Solid solid = read_solid(t, shape, solids_);
  const double edge_m = t.number("edge_m", length());
  const SdfMesh mesh = mesh_shape(surface_of(solid), even_edges(edge_m));
  if (mesh.triangles.empty()) t.fail("shape", "leaves nothing to mesh");
  if (notes_ != nullptr) {
    if (!mesh.fell_back.empty())
      notes_->push_back(t.where("shape") +
                        " is meshed on a lattice, without its edges: " + mesh.fell_back);
    for (const std::string& note : mesh.notes) notes_->push_back(t.where("shape") + ": " + note);
  }
  meshed_ = mesh.as_mesh("");
  if (t.has("crinkle_mm")) {
    CrinkleSpec spec;
    spec.height_m = 1e-3 * t.number("crinkle_mm", length());
    spec.length_m = 1e-3 * t.number("crinkle_length_mm", positive());
    if (edge_m > spec.length_m)
      t.fail("edge_m", "must be at most crinkle_length_mm, or no fold is seen");
    crinkle(meshed_, spec);
  }
  return meshed_;
}

void Target::shape_part(const ConfigTable& t, const std::string& shape, const Pose& pose) {
  if (shape == "revolved" || shape == "band" || shape == "dish")
    return revolve_part(t, shape, pose);
  if (shape == "rod") {
    const auto from = t.numbers("from_m", 3, between(-kLargest_m, kLargest_m));
    const auto to = t.numbers("to_m", 3, between(-kLargest_m, kLargest_m));
    const Vector3d a(from[0], from[1], from[2]);
    const Vector3d b(to[0], to[1], to[2]);
    if (a == b) t.fail("to_m", "must be another place than from_m");
    return builder_.rod(pose, a, b, t.number("radius_m", length()),
                        read_sweep(t, kRodSegments).segments);
  }
  if (t.has("edge_m") || is_only_meshed(shape)) return builder_.add(pose, meshed_part(t, shape));
  if (shape == "box") {
    const auto size = t.numbers("size_m", 3, length());
    return builder_.box(pose, {size[0], size[1], size[2]});
  }
  const double half_m = 0.5 * t.number(shape == "disc" ? "thickness_m" : "length_m", length());
  const ConeRadii radii = read_radii(t, shape);
  builder_.revolve(pose,
                   {{-half_m, 0.0}, {-half_m, radii.from_m}, {half_m, radii.to_m}, {half_m, 0.0}},
                   read_sweep(t, kSegments));
}

void Target::read_part(const std::string& name) {
  const ConfigTable t = config_.table("parts." + name);
  const std::string shape = t.text("shape");
  const ConfigTable::Choices<bool> shapes = {
      {"box", true},         {"cylinder", true}, {"cone", true},     {"disc", true},
      {"rod", true},         {"band", true},     {"revolved", true}, {"dish", true},
      {"sphere", true},      {"torus", true},    {"union", true},    {"difference", true},
      {"intersection", true}};
  static_cast<void>(t.choice_or("shape", shape, shapes));
  const std::string material = t.text("material");
  const std::string group = t.text_or("group", "body");
  const std::vector<PlacedGroup> frames = frames_of(t, frames_);
  meshed_ = Mesh{};
  for (const PlacedGroup& frame : frames) {
    builder_.choose(material, t.has("group") || frame.group.empty() ? group : frame.group);
    for (const Pose& pose : read_places(t)) {
      shape_part(t, shape, frame.pose * pose);
      if (builder_.triangles() > kMostTriangles)
        t.fail("shape", "brings the target to over two million triangles");
    }
  }
}

GroupedMesh Target::build() {
  const ConfigTable about = config_.table("target");
  static_cast<void>(about.text_or("about", ""));
  for (const std::string& name : config_.tables_in_order("frames"))
    frames_[name] = read_frame(config_.table("frames." + name), frames_);
  for (const std::string& name : config_.tables_in_order("solids")) {
    const ConfigTable t = config_.table("solids." + name);
    const std::vector<Pose> places = read_places(t);
    if (places.size() != 1) t.fail("shape", "of a solid has one place");
    solids_.emplace(name, read_solid(t, t.text("shape"), solids_).moved(places.front()));
  }
  const std::vector<std::string> parts = config_.tables_in_order("parts");
  if (parts.empty()) throw ConfigError(config_.name() + ": expected [parts.NAME], found none");
  for (const std::string& name : parts) read_part(name);
  config_.reject_unknown_keys("a target's description");
  return std::move(builder_).target();
}

}  // namespace

bool is_described_target(const std::string& name_or_path) {
  return name_or_path.ends_with(".toml") || !built_in_target_text(name_or_path).empty();
}

GroupedMesh described_target(const std::string& name_or_path, std::vector<std::string>* notes) {
  const std::string_view text = built_in_target_text(name_or_path);
  if (!text.empty())
    return described_target_text(std::string(text), "built-in " + name_or_path + ".toml", notes);
  return described_target_text(scenario_text(name_or_path), name_or_path, notes);
}

GroupedMesh described_target_text(const std::string& text, const std::string& name,
                                  std::vector<std::string>* notes) {
  return Target(text, name, notes).build();
}

}  // namespace engine
