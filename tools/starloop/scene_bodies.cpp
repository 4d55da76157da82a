#include "tools/starloop/scene_bodies.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <map>
#include <tuple>
#include <utility>

#include "engine/core/contract.h"
#include "engine/scene/brdf_check.h"
#include "engine/scene/mesh_spec.h"

namespace starloop {
namespace {

using engine::ConfigError;
using engine::GroupedMesh;
using engine::MeshSpec;
using engine::PartSpec;
using engine::TracedTarget;

/// Says what was left out, and what looks wrong.
GroupedMesh load(const MeshSpec& spec, const std::vector<engine::Material>& materials) {
  engine::MeshReport report;
  GroupedMesh grouped = engine::load_mesh(spec, report);
  const char* name = spec.name.c_str();
  if (report.left_out() > 0)
    std::fprintf(stderr, "%s: %zu of %zu faces left out; 'starloop mesh' says which and why\n",
                 name, report.left_out(), report.faces);
  for (const std::string& warning : report.warnings)
    std::fprintf(stderr, "%s: %s\n", name, warning.c_str());
  engine::give_materials(grouped.mesh, spec, materials);
  return grouped;
}

/// "a", "b" and so on.
std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

/// Takes meshes apart, and makes each shape once.
class Workshop {
 public:
  explicit Workshop(const Scenario& scenario) : scenario_(scenario) {}

  /// What is left of a body without its parts.
  std::shared_ptr<TracedTarget> body(std::size_t owner) {
    const File& file = read(owner);
    const std::vector<bool> rest = rest_of(owner, file);
    return shape(file, rest, Eigen::Vector3d::Zero());
  }
  /// With its hinge in the origin.
  std::shared_ptr<TracedTarget> part(const PartSpec& part) {
    const File& file = read(part.owner);
    return shape(file, groups_of(part, file), part.hinge_m);
  }
  /// A body and its parts in one, as they stand.
  std::shared_ptr<TracedTarget> body_as(std::size_t owner, const engine::Snapshot& as) {
    const File& file = read(owner);
    const Eigen::Matrix3d owner_from_target =
        owner == 0 ? Eigen::Matrix3d::Identity() : as.companion[owner - 1].from_target.matrix;
    engine::Mesh whole = file.grouped.part(rest_of(owner, file));
    for (std::size_t i = 0; i < scenario_.parts.size(); ++i) {
      const PartSpec& spec = scenario_.parts[i];
      if (spec.owner != owner) continue;
      const Eigen::Matrix3d to_owner =
          owner_from_target * as.part[i].from_target.matrix.transpose();
      const engine::Mesh part = at_hinge(file, groups_of(spec, file), spec.hinge_m);
      const auto first = static_cast<std::uint32_t>(whole.vertices.size());
      for (const Eigen::Vector3f& v : part.vertices)
        whole.vertices.push_back((to_owner * v.cast<double>() + spec.hinge_m).cast<float>());
      for (engine::Mesh::Triangle triangle : part.triangles) {
        for (std::uint32_t& corner : triangle.corner) corner += first;
        whole.triangles.push_back(triangle);  // of one file, materials have one order
      }
    }
    return std::make_shared<TracedTarget>(std::move(whole), file.brdfs);
  }

 private:
  struct File {
    std::size_t number = 0;
    const MeshSpec& spec;
    GroupedMesh grouped;
    std::vector<engine::Brdf> brdfs;
  };
  using Key = std::tuple<std::size_t, std::vector<bool>, std::array<double, 3>>;

  const File& read(std::size_t owner) {
    const MeshSpec& spec = owner == 0 ? scenario_.mesh : scenario_.companions[owner - 1].mesh;
    const auto same =
        std::ranges::find_if(files_, [&](const File& file) { return file.spec.same_body(spec); });
    if (same != files_.end()) return *same;
    GroupedMesh grouped = load(spec, scenario_.materials);
    std::vector<engine::Brdf> brdfs = engine::brdfs_of(grouped.mesh, scenario_.materials);
    files_.push_back({files_.size(), spec, std::move(grouped), std::move(brdfs)});
    return files_.back();
  }

  static std::vector<bool> groups_of(const PartSpec& part, const File& file) {
    const std::vector<std::string>& names = file.grouped.group_names;
    std::vector<bool> groups(names.size(), false);
    for (const std::string& name : part.groups) {
      const auto it = std::ranges::find(names, name);
      if (it == names.end()) {
        throw ConfigError(part.where + " names \"" + name + "\", the mesh " + file.spec.name +
                          " has the groups " + listed(names));
      }
      groups[static_cast<std::size_t>(it - names.begin())] = true;
    }
    const std::vector<std::uint32_t>& all = file.grouped.group;
    if (std::ranges::none_of(all, [&](std::uint32_t group) { return groups[group]; }))
      throw ConfigError(part.where + " names groups without a face that can be used");
    return groups;
  }

  std::vector<bool> rest_of(std::size_t owner, const File& file) const {
    std::vector<bool> rest(file.grouped.group_names.size(), true);
    for (const PartSpec& part : scenario_.parts) {
      if (part.owner != owner) continue;
      const std::vector<bool> own = groups_of(part, file);
      for (std::size_t i = 0; i < own.size(); ++i) {
        if (own[i] && !rest[i]) {
          throw ConfigError(part.where + " has the group \"" + file.grouped.group_names[i] +
                            "\", which another part has, too");
        }
        rest[i] = rest[i] && !own[i];
      }
    }
    if (std::ranges::none_of(file.grouped.group, [&](std::uint32_t group) { return rest[group]; }))
      throw ConfigError(file.spec.where + ": the parts that turn leave nothing of the body itself");
    return rest;
  }

  static engine::Mesh at_hinge(const File& file, const std::vector<bool>& groups,
                               const Eigen::Vector3d& hinge_m) {
    engine::Mesh own = file.grouped.part(groups);
    for (Eigen::Vector3f& v : own.vertices) v = (v.cast<double>() - hinge_m).cast<float>();
    return own;
  }

  std::shared_ptr<TracedTarget> shape(const File& file, const std::vector<bool>& groups,
                                      const Eigen::Vector3d& hinge_m) {
    std::shared_ptr<TracedTarget>& made =
        shapes_[{file.number, groups, {hinge_m.x(), hinge_m.y(), hinge_m.z()}}];
    if (made == nullptr)
      made = std::make_shared<TracedTarget>(at_hinge(file, groups, hinge_m), file.brdfs);
    return made;
  }

  const Scenario& scenario_;
  std::deque<File> files_;
  std::map<Key, std::shared_ptr<TracedTarget>> shapes_;
};

}  // namespace

std::size_t SceneBodies::triangles() const {
  std::size_t sum = target->mesh.triangles.size();
  for (const auto& companion : others.companions) sum += companion->mesh.triangles.size();
  for (const auto& part : others.parts) sum += part.shape->mesh.triangles.size();
  return sum;
}

std::set<std::string> SceneBodies::materials() const {
  // Parts know no other materials than their bodies.
  std::set<std::string> names(target->mesh.material_names.begin(),
                              target->mesh.material_names.end());
  for (const auto& companion : others.companions)
    names.insert(companion->mesh.material_names.begin(), companion->mesh.material_names.end());
  return names;
}

std::vector<std::string> SceneBodies::material_notes() const {
  std::map<std::string, std::string> by_name;
  // Parts know no other materials than their bodies.
  const auto add = [&](const TracedTarget& body) {
    const std::vector<std::string>& names = body.mesh.material_names;
    for (std::uint32_t m = 0; m < names.size(); ++m)
      if (!by_name.contains(names[m]))
        by_name[names[m]] = engine::brdf_note(names[m], engine::check_brdf(body.facets.brdf(m)));
  };
  add(*target);
  for (const auto& companion : others.companions) add(*companion);
  std::vector<std::string> notes;
  for (const auto& [name, note] : by_name)
    if (!note.empty()) notes.push_back(note);
  return notes;
}

SceneBodies make_bodies(const Scenario& scenario, const engine::Snapshot* frozen) {
  Workshop workshop(scenario);
  const auto body = [&](std::size_t owner) {
    const bool has_parts = std::ranges::any_of(
        scenario.parts, [owner](const PartSpec& part) { return part.owner == owner; });
    return frozen != nullptr && has_parts ? workshop.body_as(owner, *frozen) : workshop.body(owner);
  };
  SceneBodies all;
  all.target = body(0);
  for (std::size_t i = 0; i < scenario.companions.size(); ++i)
    all.others.companions.push_back(body(i + 1));
  if (frozen != nullptr) return all;
  for (const PartSpec& part : scenario.parts)
    all.others.parts.push_back({workshop.part(part), part.owner});
  return all;
}

}  // namespace starloop
