#include "engine/scene/companion.h"

namespace engine {
namespace {

constexpr double kFarthest_m = 1e6;

OrbitalOffset read_offset(const ConfigTable& table) {
  const Range near = between(-kFarthest_m, kFarthest_m);
  return {table.number_or("radial_m", 0.0, near), table.number_or("along_m", 0.0, near),
          table.number_or("cross_m", 0.0, near)};
}

CompanionSpec read_companion(const ConfigReader& config, const std::string& name) {
  const ConfigTable all = config.table("companions");
  const std::string path = "companions." + name;
  const ConfigTable table = config.table(path);
  CompanionSpec spec;
  spec.name = name;
  spec.mesh = table.text_or("mesh", spec.mesh);
  spec.mesh_where = table.where("mesh");
  spec.attitude = read_attitude(table);
  const bool held = table.has("radial_m") || table.has("along_m") || table.has("cross_m");
  if (table.has("orbit")) {
    if (held) table.fail("orbit", "and radial_m, along_m, cross_m exclude each other");
    spec.orbit = read_orbit(config.table(path + ".orbit"));
    return spec;
  }
  if (!held) {
    all.fail(name,
             "must have a table orbit, or radial_m, along_m or cross_m: where it is held "
             "beside the target");
  }
  spec.offset = read_offset(table);
  return spec;
}

}  // namespace

std::vector<CompanionSpec> read_companions(const ConfigReader& config) {
  const std::vector<std::string> names = config.tables_below("companions");
  if (names.size() > kMostCompanions) {
    config.table("companions")
        .fail(names[kMostCompanions], "is one too many: there may be " +
                                          std::to_string(kMostCompanions) + ", got " +
                                          std::to_string(names.size()));
  }
  std::vector<CompanionSpec> companions;
  companions.reserve(names.size());
  for (const std::string& name : names) companions.push_back(read_companion(config, name));
  return companions;
}

}  // namespace engine
