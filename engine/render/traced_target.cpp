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

std::vector<Brdf> in_mesh_order(const Mesh& mesh, const std::vector<Material>& materials) {
  std::vector<Brdf> brdfs;
  for (const std::string& name : mesh.material_names) {
    const auto it = std::find_if(materials.begin(), materials.end(),
                                 [&](const Material& m) { return m.name == name; });
    if (it == materials.end()) throw ConfigError(material_missing(name));
    brdfs.push_back(it->brdf());
  }
  return brdfs;
}

}  // namespace

TracedTarget::TracedTarget(Mesh its_mesh, const std::vector<Material>& materials)
    : mesh(std::move(its_mesh)),
      bounding_radius_m(mesh.bounding_radius_m()),
      scene(mesh),
      facets(mesh, in_mesh_order(mesh, materials)) {}

}  // namespace engine
