#include "tools/starloop/scene_bodies.h"

#include <algorithm>
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

/// Makes each shape once.
class Workshop {
 public:
  explicit Workshop(const Scenario& scenario) : scenario_(scenario) {}

  /// What is left of a body without its parts.
  std::shared_ptr<TracedTarget> body(std::size_t owner) {
    const File& file = read(owner);
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
    return shape(file, rest, Eigen::Vector3d::Zero());
  }
  /// With its hinge in the origin.
  std::shared_ptr<TracedTarget> part(const PartSpec& part) {
    const File& file = read(part.owner);
    return shape(file, groups_of(part, file), part.hinge_m);
  }

 private:
  struct File {
    std::size_t number = 0;
    const MeshSpec& spec;
    GroupedMesh grouped;
  };
  using Key = std::tuple<std::size_t, std::vector<bool>, std::array<double, 3>>;

  const File& read(std::size_t owner) {
    const MeshSpec& spec = owner == 0 ? scenario_.mesh : scenario_.companions[owner - 1].mesh;
    const auto same =
        std::ranges::find_if(files_, [&](const File& file) { return file.spec.same_body(spec); });
    if (same != files_.end()) return *same;
    files_.push_back({files_.size(), spec, load(spec, scenario_.materials)});
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
    return groups;
  }

  std::shared_ptr<TracedTarget> shape(const File& file, const std::vector<bool>& groups,
                                      const Eigen::Vector3d& origin_m) {
    std::shared_ptr<TracedTarget>& made =
        shapes_[{file.number, groups, {origin_m.x(), origin_m.y(), origin_m.z()}}];
    if (made != nullptr) return made;
    engine::Mesh own = file.grouped.part(groups);
    if (own.triangles.empty()) {
      throw ConfigError(file.spec.where + ": the parts that turn leave nothing of the body itself");
    }
    for (Eigen::Vector3f& v : own.vertices) v = (v.cast<double>() - origin_m).cast<float>();
    made = std::make_shared<TracedTarget>(std::move(own), scenario_.materials);
    return made;
  }

  const Scenario& scenario_;
  std::deque<File> files_;
  std::map<Key, std::shared_ptr<TracedTarget>> shapes_;
};

/// Each body that has some becomes one mesh with them.
void fix_parts(const Scenario& scenario, const engine::Snapshot& as, Workshop& workshop,
               std::vector<std::shared_ptr<TracedTarget>>& bodies) {
  std::map<std::size_t, engine::Mesh> whole;
  for (std::size_t i = 0; i < scenario.parts.size(); ++i) {
    const PartSpec& spec = scenario.parts[i];
    engine::Mesh& mesh = whole.try_emplace(spec.owner, bodies[spec.owner]->mesh).first->second;
    const engine::PartView& view = as.part[i];
    const Eigen::Matrix3d owner_from_target = spec.owner == 0
                                                  ? Eigen::Matrix3d::Identity()
                                                  : as.companion[spec.owner - 1].from_target.matrix;
    const Eigen::Matrix3d to_owner = owner_from_target * view.from_target.matrix.transpose();
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const engine::Mesh& part = workshop.part(spec)->mesh;
    for (const Eigen::Vector3f& v : part.vertices)
      mesh.vertices.push_back((to_owner * v.cast<double>() + spec.hinge_m).cast<float>());
    for (engine::Mesh::Triangle triangle : part.triangles) {
      for (std::uint32_t& corner : triangle.corner) corner += first;
      mesh.triangles.push_back(triangle);  // of one file, materials have one order
    }
  }
  for (auto& [owner, mesh] : whole)
    bodies[owner] = std::make_shared<TracedTarget>(std::move(mesh), scenario.materials);
}

}  // namespace

std::size_t SceneBodies::triangles() const {
  std::size_t sum = target->mesh.triangles.size();
  for (const auto& companion : others.companions) sum += companion->mesh.triangles.size();
  for (const auto& part : others.parts) sum += part.shape->mesh.triangles.size();
  return sum;
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
  std::vector<std::shared_ptr<TracedTarget>> bodies;
  for (std::size_t owner = 0; owner <= scenario.companions.size(); ++owner)
    bodies.push_back(workshop.body(owner));
  SceneBodies all;
  if (frozen != nullptr) {
    fix_parts(scenario, *frozen, workshop, bodies);
  } else {
    for (const PartSpec& part : scenario.parts)
      all.others.parts.push_back({workshop.part(part), part.owner});
  }
  all.target = bodies.front();
  all.others.companions.assign(bodies.begin() + 1, bodies.end());
  return all;
}

}  // namespace starloop
