#include "engine/scene/companion.h"

#include "engine/scene/body_number.h"

namespace engine {
namespace {

constexpr double kFarthest_m = 1e6;

OrbitalOffset read_offset(const ConfigTable& table) {
  const Range near = between(-kFarthest_m, kFarthest_m);
  return {table.number_or("radial_m", 0.0, near), table.number_or("along_m", 0.0, near),
          table.number_or("cross_m", 0.0, near)};
}

/// The number of a body by its name, as CompanionSpec::beside has it.
std::size_t read_beside(const ConfigTable& table, const std::vector<std::string>& names) {
  const std::string name = table.text_or("beside", "target");
  const auto number = body_number(name, names);
  if (!number)
    table.fail("beside", "must be \"target\" or the name of a companion, got \"" + name + "\"");
  return *number;
}

CompanionSpec read_companion(const ConfigReader& config, const std::string& name,
                             const std::vector<std::string>& names) {
  const ConfigTable all = config.table("companions");
  const std::string path = "companions." + name;
  const ConfigTable table = config.table(path);
  CompanionSpec spec;
  spec.name = name;
  spec.mesh = read_mesh_spec(config, path);
  spec.attitude = read_attitude(table);
  const bool held = table.has("radial_m") || table.has("along_m") || table.has("cross_m");
  if (table.has("orbit")) {
    if (held) table.fail("orbit", "and radial_m, along_m, cross_m exclude each other");
    if (table.has("beside")) table.fail("orbit", "and beside exclude each other");
    spec.orbit = read_orbit(config.table(path + ".orbit"));
    return spec;
  }
  if (!held) {
    all.fail(name,
             "must have a table orbit, or radial_m, along_m or cross_m: where it is held "
             "beside the target");
  }
  spec.offset = read_offset(table);
  spec.beside = read_beside(table, names);
  return spec;
}

/// Each chain of bodies that are held beside one another must end at one that is not.
void need_an_orbit_each(const ConfigReader& config, const std::vector<CompanionSpec>& companions) {
  for (const CompanionSpec& companion : companions) {
    std::size_t steps = 0;
    for (const CompanionSpec* at = &companion; !at->orbit && at->beside > 0; ++steps) {
      at = &companions[at->beside - 1];
      if (steps == companions.size()) {
        config.table("companions." + companion.name)
            .fail("beside", "leads back to where it began: nothing of this chain has an orbit");
      }
    }
  }
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
  for (const std::string& name : names) companions.push_back(read_companion(config, name, names));
  need_an_orbit_each(config, companions);
  return companions;
}

}  // namespace engine
