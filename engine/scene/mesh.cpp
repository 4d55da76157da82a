#include "engine/scene/mesh.h"

#include <algorithm>
#include <cmath>

#include <tiny_obj_loader.h>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::size_t kMostCorners = 10'000'000;
constexpr float kLargestCoordinate_m = 1e6F;

bool usable(const Eigen::Vector3f& v) noexcept {
  return v.allFinite() && v.cwiseAbs().maxCoeff() < kLargestCoordinate_m;
}

}  // namespace

std::uint32_t Mesh::material(const std::string& name) {
  const auto it = std::find(material_names.begin(), material_names.end(), name);
  if (it != material_names.end()) return static_cast<std::uint32_t>(it - material_names.begin());
  material_names.push_back(name);
  return static_cast<std::uint32_t>(material_names.size() - 1);
}

double Mesh::bounding_radius_m() const noexcept {
  double r2 = 0;
  for (const auto& v : vertices) r2 = std::max(r2, v.cast<double>().squaredNorm());
  return std::sqrt(r2);
}

Mesh load_obj(const std::string& path, MeshReport& report) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  if (!reader.ParseFromFile(path, config)) {
    const std::string why = reader.Error().empty() ? "cannot be read" : reader.Error();
    throw ConfigError(path + ": expected an OBJ mesh: " + why);
  }
  const auto& coordinates = reader.GetAttrib().vertices;
  const std::size_t count = coordinates.size() / 3;
  Mesh mesh;
  mesh.vertices.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    mesh.vertices.emplace_back(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]);

  for (const auto& shape : reader.GetShapes()) {
    const auto& corners = shape.mesh.indices;
    if (mesh.triangles.size() * 3 + corners.size() > kMostCorners)
      throw ConfigError(path + ": expected at most 10 million corners");
    for (std::size_t k = 0; k + 2 < corners.size(); k += 3) {
      Mesh::Triangle triangle;
      for (std::size_t c = 0; c < 3; ++c) {
        const int index = corners[k + c].vertex_index;
        if (index < 0 || static_cast<std::size_t>(index) >= count) {
          throw ConfigError(path + ": a face names vertex " + std::to_string(index + 1) +
                            ", the file has " + std::to_string(count));
        }
        triangle.corner[c] = static_cast<std::uint32_t>(index);
      }
      const auto& a = mesh.vertices[triangle.corner[0]];
      const auto& b = mesh.vertices[triangle.corner[1]];
      const auto& c = mesh.vertices[triangle.corner[2]];
      if (!usable(a) || !usable(b) || !usable(c)) {
        ++report.not_finite;
        continue;
      }
      if (!((b - a).cross(c - a).norm() > 0.0F)) {
        ++report.zero_area;
        continue;
      }
      const int id = k / 3 < shape.mesh.material_ids.size() ? shape.mesh.material_ids[k / 3] : -1;
      triangle.material = mesh.material(
          id >= 0 ? reader.GetMaterials()[static_cast<std::size_t>(id)].name : "default");
      mesh.triangles.push_back(triangle);
    }
  }
  // What no face uses any more must not blow up the bounds.
  for (auto& v : mesh.vertices)
    if (!usable(v)) v.setZero();
  if (mesh.triangles.empty()) throw ConfigError(path + ": expected a mesh, found no usable face");
  return mesh;
}

}  // namespace engine
