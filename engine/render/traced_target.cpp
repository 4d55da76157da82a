#include "engine/render/traced_target.h"

#include <algorithm>
#include <string>
#include <utility>

#include "engine/core/contract.h"

namespace engine {
namespace {

std::string material_missing(const std::string& name) {
  return "the target's mesh has a material \"" + name + "\", the scenario has no table materials." +
         name;
}

}  // namespace

std::vector<Brdf> brdfs_of(const Mesh& mesh, const std::vector<Material>& materials) {
  std::vector<Brdf> brdfs;
  std::vector<const Material*> made;
  for (const std::string& name : mesh.material_names) {
    const auto it = std::find_if(materials.begin(), materials.end(),
                                 [&](const Material& m) { return m.name == name; });
    if (it == materials.end()) throw ConfigError(material_missing(name));
    // Their tables are dear, and a simplified mesh has many alike.
    const auto same = std::ranges::find_if(made, [&](const Material* m) { return m->alike(*it); });
    brdfs.push_back(same == made.end() ? it->brdf()
                                       : brdfs[static_cast<std::size_t>(same - made.begin())]);
    made.push_back(&*it);
  }
  return brdfs;
}

TracedTarget::TracedTarget(Mesh its_mesh, const std::vector<Material>& materials)
    : TracedTarget(its_mesh, brdfs_of(its_mesh, materials)) {}

TracedTarget::TracedTarget(Mesh its_mesh, std::vector<Brdf> brdfs)
    : mesh(std::move(its_mesh)),
      bounding_radius_m(mesh.bounding_radius_m()),
      scene(mesh),
      facets(mesh, std::move(brdfs)) {}

}  // namespace engine
