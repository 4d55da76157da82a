#include "engine/scene/mesh_outside.h"

#include <algorithm>
#include <cmath>

#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr int kPairs = 128;
constexpr std::uint64_t kMostSteps = 30'000'000;  // looks at boxes, some 20 ns each
constexpr double kNearest =
    1e-6;  // of the piece's size: sheets that lie in one another hide nothing

Vector3d place(const Mesh& mesh, std::uint32_t t, std::size_t k) {
  return mesh.vertices[mesh.triangles[t].corner[k]].cast<double>();
}

std::vector<BoxTree::Box> boxes_of(const Mesh& mesh) {
  std::vector<BoxTree::Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const Mesh::Triangle& t : mesh.triangles) {
    boxes.push_back({mesh.vertices[t.corner[0]], mesh.vertices[t.corner[0]]});
    for (const std::uint32_t corner : t.corner) boxes.back().extend(mesh.vertices[corner]);
  }
  return boxes;
}

/// Of a ray from its start on. Pre: no component of `per_along` is infinite.
bool may_meet(const BoxTree::Box& box, const Vector3d& from, const Vector3d& per_along) {
  const Vector3d a = (box.low.cast<double>() - from).cwiseProduct(per_along);
  const Vector3d b = (box.high.cast<double>() - from).cwiseProduct(per_along);
  return std::max(a.cwiseMin(b).maxCoeff(), 0.0) <= a.cwiseMax(b).minCoeff();
}

/// Further than `nearest_m`. Moeller and Trumbore 1997, DOI 10.1080/10867651.1997.10487468.
bool meets(const Vector3d& from, const Vector3d& along, const Vector3d& corner, const Vector3d& e1,
           const Vector3d& e2, double nearest_m) {
  const Vector3d p = along.cross(e2);
  const double volume = e1.dot(p);
  if (volume == 0.0) return false;
  const Vector3d to = (from - corner) / volume;
  const double second = to.dot(p);
  const Vector3d q = to.cross(e1);
  const double third = along.dot(q);
  return second >= 0.0 && third >= 0.0 && second + third <= 1.0 && e2.dot(q) > nearest_m;
}

/// Areas of a piece's triangles, added up.
std::vector<double> area_up_to_m2(const Mesh& mesh, const MeshTopology::Piece& piece) {
  std::vector<double> sums;
  sums.reserve(piece.triangles.size());
  double sum_m2 = 0;
  for (const std::uint32_t t : piece.triangles) {
    const Vector3d a = place(mesh, t, 0);
    sum_m2 += 0.5 * (place(mesh, t, 1) - a).cross(place(mesh, t, 2) - a).norm();
    sums.push_back(sum_m2);
  }
  return sums;
}

/// About a unit normal, by its cosine. Source of the axes: Duff et al. 2017, Building an
/// Orthonormal Basis, Revisited, Journal of Computer Graphics Techniques 6(1).
Vector3d cosine_direction(const Vector3d& n, double u, double v) {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  const double b = n.x() * n.y() * a;
  const Vector3d x(1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
  const Vector3d y(b, sign + n.y() * n.y() * a, -n.y());
  const double radius = std::sqrt(u);
  return radius * (std::cos(2.0 * M_PI * v) * x + std::sin(2.0 * M_PI * v) * y) +
         std::sqrt(1.0 - u) * n;
}

}  // namespace

MeshOutside::MeshOutside(const Mesh& mesh)
    : mesh_(mesh), tree_(boxes_of(mesh)), steps_(kMostSteps) {}

BoxTree::Found MeshOutside::is_met(const Ray& ray, double nearest_m) {
  constexpr double kLeast = 1e-12;
  const Vector3d per_along = ray.along.unaryExpr(
      [](double x) { return 1.0 / (std::abs(x) < kLeast ? std::copysign(kLeast, x) : x); });
  return tree_.any([&](const BoxTree::Box& box) { return may_meet(box, ray.from, per_along); },
                   [&](std::uint32_t t) {
                     const Vector3d a = place(mesh_, t, 0);
                     return t != ray.triangle &&
                            meets(ray.from, ray.along, a, place(mesh_, t, 1) - a,
                                  place(mesh_, t, 2) - a, nearest_m);
                   },
                   steps_);
}

MeshOutside::Side MeshOutside::of(const MeshTopology::Piece& piece) {
  const std::vector<double> area_m2 = area_up_to_m2(mesh_, piece);
  const double nearest_m = kNearest * std::sqrt(area_m2.back());
  int first = 0;  // pairs of which only the ray of the first triangle's side leaves
  int other = 0;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    Draws draws(0, Stream::kMeshSides, piece.triangles.front(), i);
    // In equal shares of the area, so that no large part goes without.
    const double at_m2 = (i + draws.uniform_double()) / kPairs * area_m2.back();
    const auto k = static_cast<std::size_t>(
        std::min(std::ranges::upper_bound(area_m2, at_m2), area_m2.end() - 1) - area_m2.begin());
    const std::uint32_t t = piece.triangles[k];
    const Vector3d a = place(mesh_, t, 0);
    const Vector3d ab = place(mesh_, t, 1) - a;
    const Vector3d ac = place(mesh_, t, 2) - a;
    const Vector3d normal = (piece.against[k] ? -1.0 : 1.0) * ab.cross(ac).normalized();
    const double root = std::sqrt(draws.uniform_double());
    const double share = draws.uniform_double();
    const Vector3d from = a + root * ((1.0 - share) * ab + share * ac);
    const double u = draws.uniform_double();
    const Vector3d along = cosine_direction(normal, u, draws.uniform_double());
    const Vector3d mirrored = along - 2.0 * normal.dot(along) * normal;
    const BoxTree::Found before = is_met({from, along, t}, nearest_m);
    const BoxTree::Found behind = is_met({from, mirrored, t}, nearest_m);
    if (behind == BoxTree::Found::kGaveUp) return Side::kGaveUp;
    if (before == BoxTree::Found::kNo && behind == BoxTree::Found::kYes) ++first;
    if (before == BoxTree::Found::kYes && behind == BoxTree::Found::kNo) ++other;
  }
  // Of n pairs that tell, the difference is sqrt(n) by chance.
  const int lead = first - other;
  if (lead * lead <= 9 * (first + other)) return Side::kEither;
  return lead > 0 ? Side::kFirst : Side::kOther;
}

}  // namespace engine
