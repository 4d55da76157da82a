#include "engine/scene/mesh_spec.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include <Eigen/LU>

#include "engine/core/contract.h"
#include "engine/scene/described_target.h"
#include "engine/scene/mesh_repair.h"
#include "engine/scene/obj_file.h"

namespace engine {
namespace {

// The longest side of a body: the smallest satellites flown are cubes of 5 cm (PocketQube), the
// largest is the International Space Station, 109 m.
constexpr double kSmallest_m = 0.05;
constexpr double kLargest_m = 200.0;
constexpr double kFarOrigin = 10.0;  ///< in radii of the body: a digit less for its shape

double unit_m(const std::string& units) {
  for (const auto& [word, metres] : mesh_units_m())
    if (word == units) return metres;
  throw ConfigError("units must be one of m, cm, mm, km, in, ft, got \"" + units + "\"");
}

bool is_built_in(const std::string& name) { return is_described_target(name); }

GroupedMesh built_in(const MeshSpec& spec, MeshReport& report) {
  try {
    return described_target(spec.name, &report.warnings);
  } catch (const ConfigError& e) {
    if (spec.where.empty()) throw;
    throw ConfigError(spec.where + ": " + e.what());
  }
}

std::string number_text(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

/// Sizes that the same numbers would have in units that make a spacecraft of them.
std::string other_readings(double size_m, const std::string& units) {
  std::string text;
  for (const auto& [word, metres] : mesh_units_m()) {
    const double other_m = size_m / unit_m(units) * metres;
    if (word == units || other_m < kSmallest_m || other_m > kLargest_m) continue;
    text += (text.empty() ? "; with units = \"" : ", with \"") + word + "\" it would be " +
            number_text(other_m) + " m";
  }
  return text;
}

void warn_of_size(const MeshSpec& spec, MeshReport& report) {
  const Eigen::Vector3d size_m = report.high_m - report.low_m;
  const double longest_m = size_m.maxCoeff();
  if (longest_m < kSmallest_m || longest_m > kLargest_m) {
    report.warnings.push_back("the body is " + number_text(longest_m) +
                              " m long, which no spacecraft is" +
                              other_readings(longest_m, spec.units));
  }
  const double off_m = (0.5 * (report.low_m + report.high_m)).norm();
  if (off_m > kFarOrigin * 0.5 * size_m.norm()) {
    report.warnings.push_back(
        "the body's middle is " + number_text(off_m) + " m from its origin, which is what flies " +
        "and turns: move it there; so far out its shape loses a digit and more");
  }
}

GroupedMesh load_file(const MeshSpec& spec, MeshReport& report) {
  ObjFile file = read_obj(spec.name, report);
  const Eigen::Matrix3f to_body = static_cast<float>(unit_m(spec.units)) * spec.axes;
  for (Eigen::Vector3f& v : file.grouped.mesh.vertices) v = to_body * v;
  repair(file.grouped, std::move(file.line), report);
  if (file.grouped.mesh.triangles.empty())
    throw ConfigError(spec.name + ": expected a mesh, found no usable face");
  warn_of_size(spec, report);
  return std::move(file.grouped);
}

std::string quoted(const std::vector<std::string>& names) {
  constexpr std::size_t kEnough = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kEnough); ++i)
    text += (i > 0 ? ", \"" : "\"") + names[i] + "\"";
  return names.empty() ? "none" : text + (names.size() > kEnough ? ", ..." : "");
}

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// The table that a mesh is named in, for advice: "file:3: target.mesh" -> "target".
std::string table_of(const std::string& where) {
  const std::size_t from = where.rfind(' ') + 1;
  return where.substr(from, where.rfind('.') - from);
}

}  // namespace

bool MeshSpec::same_body(const MeshSpec& other) const {
  return name == other.name && units == other.units && axes == other.axes &&
         default_material == other.default_material &&
         std::ranges::equal(materials, other.materials, [](const Renamed& a, const Renamed& b) {
           return a.from == b.from && a.to == b.to;
         });
}

std::vector<std::pair<std::string, double>> mesh_units_m() {
  return {{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"km", 1e3}, {"in", 0.0254}, {"ft", 0.3048}};
}

Eigen::Matrix3f mesh_axes(const std::string& text, const std::string& where) {
  const std::string wanted =
      where +
      " must be three axes of the file, such as \"z -x -y\", that become x, y and z of the "
      "body, got \"" +
      text + "\"";
  Eigen::Matrix3f axes = Eigen::Matrix3f::Zero();
  std::istringstream words(text);
  Eigen::Index row = 0;
  for (std::string word; words >> word; ++row) {
    const float sign = word.front() == '-' ? -1.0F : 1.0F;
    if (word.front() == '-' || word.front() == '+') word.erase(0, 1);
    if (row > 2 || word.size() != 1 || word < "x" || word > "z") throw ConfigError(wanted);
    axes(row, word.front() - 'x') = sign;
  }
  const float turn = axes.determinant();
  if (row != 3 || turn == 0.0F) throw ConfigError(wanted);
  if (turn < 0.0F)
    throw ConfigError(where + " must be a turn, got \"" + text +
                      "\", which mirrors the body: change one sign, or swap two axes");
  return axes;
}

MeshSpec read_mesh_spec(const ConfigReader& config, const std::string& table_name) {
  const ConfigTable table = config.table(table_name);
  MeshSpec spec;
  spec.name = table.text_or("mesh", spec.name);
  spec.where = table.where("mesh");
  for (const char* key : {"units", "axes"})
    if (table.has(key) && is_built_in(spec.name))
      table.fail(key, "is for a mesh from a file: \"" + spec.name + "\" is in metres, body axes");
  ConfigTable::Choices<std::string> units;
  for (const auto& [word, metres] : mesh_units_m()) units.emplace_back(word, word);
  spec.units = table.choice_or<std::string>("units", spec.units, units);
  if (table.has("axes")) spec.axes = mesh_axes(table.text("axes"), table.where("axes"));
  for (const ConfigTable::NamedText& entry : config.table(table_name + ".materials").named_texts())
    spec.materials.push_back({entry.name, entry.text, entry.where});
  spec.default_material = table.text_or("default_material", "");
  spec.default_where = table.where("default_material");
  return spec;
}

GroupedMesh load_mesh(const MeshSpec& spec, MeshReport& report) {
  if (is_built_in(spec.name)) {
    if (spec.units != "m" || !spec.axes.isIdentity())
      throw ConfigError("units and axes are for a mesh from a file: \"" + spec.name +
                        "\" is in metres, body axes");
    GroupedMesh grouped = built_in(spec, report);
    GroupedMesh looked_at = grouped;
    report.vertices = grouped.mesh.vertices.size();
    report.faces = grouped.mesh.triangles.size();
    repair(looked_at, {}, report);
    return grouped;
  }
  try {
    return load_file(spec, report);
  } catch (const ConfigError& e) {
    if (spec.where.empty()) throw;
    throw ConfigError(spec.where + ": " + e.what());
  }
}

void give_materials(Mesh& mesh, const MeshSpec& spec, const std::vector<Material>& materials) {
  std::vector<std::string> known;
  for (const Material& m : materials) known.push_back(m.name);
  const std::vector<std::string> found = mesh.material_names;
  for (const MeshSpec::Renamed& renamed : spec.materials) {
    if (!holds(known, renamed.to))
      throw ConfigError(renamed.where + " must be one of the scenario's materials, " +
                        quoted(known) + ", got \"" + renamed.to + "\"");
    if (!holds(found, renamed.from))
      throw ConfigError(renamed.where + " is for a material that the mesh does not have: it has " +
                        quoted(found));
    for (std::size_t i = 0; i < found.size(); ++i)
      if (found[i] == renamed.from) mesh.material_names[i] = renamed.to;
  }
  if (!spec.default_material.empty() && !holds(known, spec.default_material))
    throw ConfigError(spec.default_where + " must be one of the scenario's materials, " +
                      quoted(known) + ", got \"" + spec.default_material + "\"");
  for (std::string& name : mesh.material_names) {
    if (holds(known, name)) continue;
    if (spec.default_material.empty()) {
      const std::string table = table_of(spec.where);
      throw ConfigError(spec.where + " has the materials " + quoted(found) + ", the scenario has " +
                        quoted(known) + ": nothing says what \"" + name + "\" is. Name one in [" +
                        table + ".materials], or set " + table + ".default_material");
    }
    name = spec.default_material;
  }
}

}  // namespace engine
