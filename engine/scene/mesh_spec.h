#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "engine/core/config_reader.h"
#include "engine/scene/grouped_mesh.h"
#include "engine/scene/material.h"
#include "engine/scene/mesh_report.h"

namespace engine {

/// Which mesh a body has, and how it becomes one in metres, in body axes, of the scenario's
/// materials.
struct MeshSpec {
  std::string name = "telescope";  ///< built in, or the path of a description or an OBJ file
  std::string where;               ///< the place in the scenario that names it
  std::string units = "m";         ///< of the file
  /// Body coordinates from the file's: each row has one entry, 1 or -1; no mirror.
  Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();
  struct Renamed {
    std::string from;  ///< as the file has it
    std::string to;    ///< as the scenario has it
    std::string where;
  };
  std::vector<Renamed> materials;
  std::string default_material;  ///< of those that the scenario does not have; empty: none
  std::string default_where;

  /// Whether both give the same body.
  [[nodiscard]] bool same_body(const MeshSpec& other) const;
};

/// Words that `units` may be: m, cm, mm, km, in, ft.
[[nodiscard]] std::vector<std::pair<std::string, double>> mesh_units_m();
/// "z -x -y": the axes of the file that become x, y and z of the body. Throws ConfigError, which
/// begins with `where`, for what is no turn: an axis twice, a mirror.
[[nodiscard]] Eigen::Matrix3f mesh_axes(const std::string& text, const std::string& where);

/// Reads mesh, units, axes and default_material of a table, and its table `materials`.
[[nodiscard]] MeshSpec read_mesh_spec(const ConfigReader& config, const std::string& table);

/// The mesh in metres and body axes, repaired; a built-in one as it is. The report says what it was
/// like, and warns of a size that no spacecraft has and of an origin far from the body.
/// Throws ConfigError.
[[nodiscard]] GroupedMesh load_mesh(const MeshSpec& spec, MeshReport& report);

/// Gives the mesh's materials the names of the scenario's. Throws ConfigError, with the names that
/// there are: one that neither has, one that no triangle is of.
void give_materials(Mesh& mesh, const MeshSpec& spec, const std::vector<Material>& materials);

}  // namespace engine
