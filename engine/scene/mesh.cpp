#include "engine/scene/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>

#include <tiny_obj_loader.h>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::size_t kMostCorners = 10'000'000;
constexpr float kLargestCoordinate_m = 1e6F;

/// Which vertices have a coordinate that is no number: the importer reads those as zero.
std::vector<bool> unreadable_vertices(const std::string& path) {
  std::vector<bool> unreadable;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::size_t start = line.find_first_not_of(" \t");
    if (start == std::string::npos || line.compare(start, 1, "v") != 0 ||
        start + 1 >= line.size() || (line[start + 1] != ' ' && line[start + 1] != '\t')) {
      continue;
    }
    const char* at = line.c_str() + start + 1;
    bool good = true;
    for (int i = 0; i < 3 && good; ++i) {
      char* end = nullptr;
      good = std::isfinite(std::strtod(at, &end)) && end != at;
      at = end;
    }
    unreadable.push_back(!good);
  }
  return unreadable;
}

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

std::vector<CornerNormals> smooth_normals(const Mesh& mesh, double crease_rad) {
  using Eigen::Vector3f;
  struct Corner {
    std::size_t triangle;
    Vector3f normal;
    float angle;
  };
  // By place, not by index: parts of a mesh often have corners of their own.
  std::map<std::array<float, 3>, std::vector<Corner>> round_place;
  const auto place = [&](const Mesh::Triangle& t, std::size_t c) -> const Vector3f& {
    return mesh.vertices[t.corner[c]];
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Mesh::Triangle& t = mesh.triangles[i];
    for (std::size_t c = 0; c < 3; ++c) {
      const Vector3f& p = place(t, c);
      const Vector3f e1 = place(t, (c + 1) % 3) - p;
      const Vector3f e2 = place(t, (c + 2) % 3) - p;
      const Vector3f across = e1.cross(e2);
      round_place[{p.x(), p.y(), p.z()}].push_back(
          {i, across.normalized(), std::atan2(across.norm(), e1.dot(e2))});
    }
  }
  const auto crease_cosine = static_cast<float>(std::cos(crease_rad));
  std::vector<CornerNormals> normals(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Vector3f& p = place(mesh.triangles[i], c);
      const std::vector<Corner>& corners = round_place[{p.x(), p.y(), p.z()}];
      const auto own = std::find_if(corners.begin(), corners.end(),
                                    [i](const Corner& corner) { return corner.triangle == i; });
      Vector3f sum = Vector3f::Zero();
      for (const Corner& corner : corners)
        if (const float cosine = corner.normal.dot(own->normal); std::abs(cosine) >= crease_cosine)
          sum += std::copysign(corner.angle, cosine) * corner.normal;  // a face may run backwards
      normals[i][c] = sum.normalized();
    }
  }
  return normals;
}

Mesh load_obj(const std::string& path, MeshReport& report) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  if (!reader.ParseFromFile(path, config)) {
    std::string why = reader.Error().empty() ? "cannot be read" : reader.Error();
    while (why.back() == '\n') why.pop_back();
    throw ConfigError(path + ": expected an OBJ mesh: " + why);
  }
  const auto& coordinates = reader.GetAttrib().vertices;
  const std::size_t count = coordinates.size() / 3;
  Mesh mesh;
  mesh.vertices.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    mesh.vertices.emplace_back(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]);
  const std::vector<bool> unreadable = unreadable_vertices(path);
  for (std::size_t i = 0; i < std::min(count, unreadable.size()); ++i)
    if (unreadable[i]) mesh.vertices[i].setConstant(std::numeric_limits<float>::quiet_NaN());

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
