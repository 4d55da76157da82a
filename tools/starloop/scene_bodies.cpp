#include "tools/starloop/scene_bodies.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <tuple>
#include <utility>

#include "engine/core/contract.h"
#include "engine/scene/grouped_mesh.h"
#include "engine/scene/telescope.h"

namespace starloop {
namespace {

using engine::ConfigError;
using engine::GroupedMesh;
using engine::PartSpec;
using engine::TracedTarget;

engine::Mesh load_mesh(const std::string& name) {
  if (name == "telescope") return engine::telescope_mesh();
  engine::MeshReport report;
  engine::Mesh mesh = engine::load_obj(name, report);
  if (report.left_out() > 0)
    std::fprintf(stderr, "%s: %zu faces left out: %zu not finite, %zu without area\n", name.c_str(),
                 report.left_out(), report.not_finite, report.zero_area);
  return mesh;
}

GroupedMesh load_grouped(const std::string& name) {
  GroupedMesh grouped{load_mesh(name), {name}, {}};
  grouped.group.resize(grouped.mesh.triangles.size());
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
    const auto [mesh, where] = mesh_of(owner);
    const GroupedMesh& grouped = read(mesh, where);
    std::vector<bool> rest(grouped.group_names.size(), true);
    for (const PartSpec& part : scenario_.parts) {
      if (part.owner != owner) continue;
      const std::vector<bool> own = groups_of(part);
      for (std::size_t i = 0; i < own.size(); ++i) {
        if (own[i] && !rest[i]) {
          throw ConfigError(part.where + " has the group \"" + grouped.group_names[i] +
                            "\", which another part has, too");
        }
        rest[i] = rest[i] && !own[i];
      }
    }
    return shape(mesh, where, rest, Eigen::Vector3d::Zero());
  }
  /// With its hinge in the origin.
  std::shared_ptr<TracedTarget> part(const PartSpec& part) {
    return shape(mesh_of(part.owner).first, part.where, groups_of(part), part.hinge_m);
  }

 private:
  using Key = std::tuple<std::string, std::vector<bool>, std::array<double, 3>>;

  /// And the place in the scenario that names it.
  [[nodiscard]] std::pair<std::string, std::string> mesh_of(std::size_t owner) const {
    if (owner == 0) return {scenario_.mesh, scenario_.mesh_where};
    const engine::CompanionSpec& companion = scenario_.companions[owner - 1];
    return {companion.mesh, companion.mesh_where};
  }

  const GroupedMesh& read(const std::string& mesh, const std::string& where) {
    const auto known = files_.find(mesh);
    if (known != files_.end()) return known->second;
    try {
      return files_.emplace(mesh, load_grouped(mesh)).first->second;
    } catch (const ConfigError& e) {
      throw ConfigError(where + ": " + e.what());
    }
  }

  std::vector<bool> groups_of(const PartSpec& part) {
    const auto [mesh, where] = mesh_of(part.owner);
    const std::vector<std::string>& names = read(mesh, where).group_names;
    std::vector<bool> groups(names.size(), false);
    for (const std::string& name : part.groups) {
      const auto it = std::ranges::find(names, name);
      if (it == names.end()) {
        throw ConfigError(part.where + " names \"" + name + "\", the mesh " + mesh +
                          " has the groups " + listed(names));
      }
      groups[static_cast<std::size_t>(it - names.begin())] = true;
    }
    return groups;
  }

  std::shared_ptr<TracedTarget> shape(const std::string& mesh, const std::string& where,
                                      const std::vector<bool>& groups,
                                      const Eigen::Vector3d& origin_m) {
    std::shared_ptr<TracedTarget>& made =
        shapes_[{mesh, groups, {origin_m.x(), origin_m.y(), origin_m.z()}}];
    if (made != nullptr) return made;
    engine::Mesh own = files_.at(mesh).part(groups);
    if (own.triangles.empty())
      throw ConfigError(where + ": the parts that turn leave nothing of the body itself");
    for (Eigen::Vector3f& v : own.vertices) v = (v.cast<double>() - origin_m).cast<float>();
    try {
      made = std::make_shared<TracedTarget>(std::move(own), scenario_.materials);
    } catch (const ConfigError& e) {
      throw ConfigError(where + ": " + e.what());
    }
    return made;
  }

  const Scenario& scenario_;
  std::map<std::string, GroupedMesh> files_;
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
