#include "engine/scene/material.h"

#include <algorithm>

#include "engine/core/constants.h"

namespace engine {

Brdf Material::brdf() const {
  if (table != nullptr) return Brdf(TabulatedBrdf(table, reciprocal));
  return {parameters, variant, wrinkle_rad};
}

bool Material::alike(const Material& other) const {
  return parameters == other.parameters && variant == other.variant &&
         wrinkle_rad == other.wrinkle_rad && table == other.table && reciprocal == other.reciprocal;
}

double Material::diffuse_albedo() const noexcept {
  return table != nullptr ? 1.0 : std::min(1.0, kPi * parameters.kd);
}

double Material::glossy_albedo() const noexcept {
  if (table != nullptr) return 1.0;
  return shines() ? 1.0 - diffuse_albedo() : 0.0;
}

namespace {

Material measured(const std::string& name, const ConfigTable& table) {
  Material material;
  material.name = name;
  material.reciprocal = table.flag_or("reciprocal", true);
  try {
    material.table = std::make_shared<BrdfGrid>(read_brdf_points(table.text("table")));
  } catch (const ConfigError& e) {
    throw ConfigError(table.where("table") + ": " + e.what());
  }
  return material;
}

}  // namespace

std::vector<Material> read_materials(const ConfigReader& config) {
  std::vector<Material> materials;
  const auto variant = config.table("brdf").choice_or<Brdf::Variant>(
      "variant", "physical",
      {{"physical", Brdf::Variant::kPhysical}, {"paper", Brdf::Variant::kPaper}});
  for (const std::string& name : config.tables_below("materials")) {
    const ConfigTable table = config.table("materials." + name);
    if (table.has("table")) {
      materials.push_back(measured(name, table));
      continue;
    }
    FiveParameters p;
    p.kd = table.number("kd", between(0.0, kMostKd));
    p.kb = table.number_or("kb", 0.0, at_least(0.0));
    p.ar = p.kb > 0.0 ? table.number("ar", positive()) : p.ar;
    p.br = p.kb > 0.0 ? table.number("br", from_below(kLeastBr, 0.0)) : p.br;
    p.kr = p.kb > 0.0 ? table.number("kr", positive()) : p.kr;
    const double wrinkle_deg = table.number_or("wrinkle_deg", 0.0, between(0.0, 30.0));
    materials.push_back({name, p, variant, wrinkle_deg * kDegree});
  }
  return materials;
}

}  // namespace engine
