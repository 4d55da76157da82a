#include "engine/scene/mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/scene/vertex_places.h"

namespace engine {

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
    Vector3f normal = Vector3f::Zero();  ///< of its triangle
    float angle = 0;
  };
  const std::size_t count = 3 * mesh.triangles.size();
  // By place, not by index: parts of a mesh often have corners of their own.
  const std::vector<std::uint32_t> place = first_at_place(mesh.vertices, 0.0);
  std::vector<Corner> corners(count);
  std::vector<std::size_t> first(mesh.vertices.size() + 1, 0);
  const auto place_of = [&](std::size_t i) { return place[mesh.triangles[i / 3].corner[i % 3]]; };
  for (std::size_t i = 0; i < count; ++i) {
    const Mesh::Triangle& t = mesh.triangles[i / 3];
    const Vector3f& p = mesh.vertices[t.corner[i % 3]];
    const Vector3f e1 = mesh.vertices[t.corner[(i + 1) % 3]] - p;
    const Vector3f e2 = mesh.vertices[t.corner[(i + 2) % 3]] - p;
    const Vector3f across = e1.cross(e2);
    corners[i] = {across.normalized(), std::atan2(across.norm(), e1.dot(e2))};
    ++first[place_of(i) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  // Corners that meet, in the order of their triangles: sums come out the same every time.
  std::vector<std::uint32_t> meeting(count);
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
    meeting[next[place_of(i)]++] = static_cast<std::uint32_t>(i);

  const auto crease_cosine = static_cast<float>(std::cos(crease_rad));
  std::vector<CornerNormals> normals(mesh.triangles.size());
  for (std::size_t i = 0; i < count; ++i) {
    Vector3f sum = Vector3f::Zero();
    for (std::size_t k = first[place_of(i)]; k < first[place_of(i) + 1]; ++k) {
      const Corner& corner = corners[meeting[k]];
      if (const float cosine = corner.normal.dot(corners[i].normal);
          std::abs(cosine) >= crease_cosine)
        sum += std::copysign(corner.angle, cosine) * corner.normal;  // a face may run backwards
    }
    normals[i / 3][i % 3] = sum.normalized();
  }
  return normals;
}

}  // namespace engine
