#include "tools/bench/fine_mesh.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <utility>
#include <vector>

#include "engine/core/contract.h"
#include "engine/core/random.h"

namespace bench {
namespace {

using Eigen::Vector3f;
using engine::Mesh;
using Corners = std::array<std::uint32_t, 3>;

constexpr std::size_t kMostTriangles = 10'000'000;
constexpr int kTries = 24;

Mesh with_shared_vertices(const Mesh& mesh) {
  Mesh out;
  out.material_names = mesh.material_names;
  std::map<std::array<float, 3>, std::uint32_t> index;
  std::vector<std::uint32_t> merged;
  for (const Vector3f& v : mesh.vertices) {
    // -0 and 0 are one place.
    const auto [it, added] = index.try_emplace({v.x() + 0.0F, v.y() + 0.0F, v.z() + 0.0F},
                                               static_cast<std::uint32_t>(out.vertices.size()));
    if (added) out.vertices.push_back(v);
    merged.push_back(it->second);
  }
  for (Mesh::Triangle t : mesh.triangles) {
    for (std::uint32_t& corner : t.corner) corner = merged[corner];
    out.triangles.push_back(t);
  }
  return out;
}

/// One round: every edge longer than `longest_m` is halved.
class Halving {
 public:
  Halving(Mesh& mesh, float longest_m) : mesh_(mesh), longest_m_(longest_m) {}

  /// False: there was nothing to halve.
  bool run() {
    std::vector<Mesh::Triangle> old;
    old.swap(mesh_.triangles);
    for (const Mesh::Triangle& t : old) divide(t);
    return !middles_.empty();
  }

 private:
  static constexpr std::uint32_t kWhole = 0xFFFFFFFFU;

  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const Vector3f from = mesh_.vertices[a];
    const Vector3f to = mesh_.vertices[b];
    if ((to - from).norm() <= longest_m_) return kWhole;
    const auto [it, added] =
        middles_.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (added) mesh_.vertices.emplace_back(0.5F * (from + to));
    return it->second;
  }
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t material) {
    mesh_.triangles.push_back({{a, b, c}, material});
  }
  void divide(const Mesh::Triangle& t) {
    const auto [a, b, c] = t.corner;
    const Corners m = {middle(a, b), middle(b, c), middle(c, a)};
    const int halved = (m[0] != kWhole) + (m[1] != kWhole) + (m[2] != kWhole);
    if (halved == 0) return add(a, b, c, t.material);
    if (halved == 3) {
      add(a, m[0], m[2], t.material);
      add(m[0], b, m[1], t.material);
      add(m[2], m[1], c, t.material);
      return add(m[0], m[1], m[2], t.material);
    }
    // Turned so that the first edge is the one that stands alone: halved, or whole.
    std::size_t first = 0;
    while ((m[first] != kWhole) != (halved == 1)) ++first;
    const std::uint32_t p = t.corner[first];
    const std::uint32_t q = t.corner[(first + 1) % 3];
    const std::uint32_t r = t.corner[(first + 2) % 3];
    if (halved == 1) {
      add(p, m[first], r, t.material);
      return add(m[first], q, r, t.material);
    }
    const std::uint32_t qr = m[(first + 1) % 3];
    const std::uint32_t rp = m[(first + 2) % 3];
    add(r, rp, qr, t.material);
    add(p, q, qr, t.material);
    add(p, qr, rp, t.material);
  }

  Mesh& mesh_;
  float longest_m_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

Mesh with_edges_up_to(const Mesh& mesh, float longest_m) {
  Mesh out = mesh;
  while (out.triangles.size() < kMostTriangles && Halving(out, longest_m).run()) {
  }
  return out;
}

}  // namespace

Mesh subdivided(const Mesh& mesh, std::size_t triangles) {
  ENSURE(triangles <= kMostTriangles);
  Mesh shared = with_shared_vertices(mesh);
  if (shared.triangles.size() >= triangles) return shared;
  // Between edges that are long enough to stay and those that make too many triangles.
  auto coarse_m = static_cast<float>(2.0 * mesh.bounding_radius_m());
  float fine_m = coarse_m;
  Mesh best = shared;
  while (best.triangles.size() < triangles) best = with_edges_up_to(shared, fine_m *= 0.5F);
  for (int i = 0; i < kTries; ++i) {
    const float between_m = std::sqrt(coarse_m * fine_m);
    Mesh tried = with_edges_up_to(shared, between_m);
    if (tried.triangles.size() < triangles) {
      coarse_m = between_m;
    } else {
      fine_m = between_m;
      best = std::move(tried);
    }
  }
  return best;
}

void wrinkle(Mesh& mesh, double rms_m, std::uint64_t seed) {
  std::vector<Vector3f> normals(mesh.vertices.size(), Vector3f::Zero());
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vector3f& a = mesh.vertices[t.corner[0]];
    const Vector3f twice_area =
        (mesh.vertices[t.corner[1]] - a).cross(mesh.vertices[t.corner[2]] - a);
    for (const std::uint32_t corner : t.corner) normals[corner] += twice_area;
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const float length = normals[i].norm();
    if (!(length > 0.0F)) continue;
    engine::Draws draws(seed, engine::Stream::kLight, 0, static_cast<std::uint32_t>(i));
    mesh.vertices[i] += static_cast<float>(rms_m) * draws.normal() / length * normals[i];
  }
}

bool write_obj(const Mesh& mesh, const std::string& path) {
  const std::string materials = path + ".mtl";
  std::ofstream names(materials);
  for (const std::string& name : mesh.material_names) names << "newmtl " << name << '\n';
  std::ofstream out(path);
  out << "mtllib " << materials.substr(materials.find_last_of('/') + 1) << '\n';
  std::array<char, 96> line{};
  for (const Vector3f& v : mesh.vertices) {
    std::snprintf(line.data(), line.size(), "v %.9g %.9g %.9g\n", static_cast<double>(v.x()),
                  static_cast<double>(v.y()), static_cast<double>(v.z()));
    out << line.data();
  }
  for (std::uint32_t m = 0; m < mesh.material_names.size(); ++m) {
    out << "usemtl " << mesh.material_names[m] << '\n';
    for (const Mesh::Triangle& t : mesh.triangles)
      if (t.material == m)
        out << "f " << t.corner[0] + 1 << ' ' << t.corner[1] + 1 << ' ' << t.corner[2] + 1 << '\n';
  }
  names.flush();
  out.flush();
  return names.good() && out.good();
}

}  // namespace bench
