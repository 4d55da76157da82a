#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/constants.h"
#include "engine/scene/sdf/features.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr int kNewtonSteps = 20;
constexpr double kMostTurn_rad = 45.0 * kDegree;

double turning_rad(const std::vector<Vector3d>& path) {
  double sum = 0;
  for (std::size_t i = 2; i < path.size(); ++i) {
    const Vector3d a = path[i - 1] - path[i - 2];
    const Vector3d b = path[i] - path[i - 1];
    sum += std::atan2(a.cross(b).norm(), a.dot(b));
  }
  return sum;
}

void settle_on_faces(const Solid& solid, const std::vector<std::size_t>& faces, Vector3d& p) {
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Vector3d a = solid.face_normal(faces[0], p);
    const Vector3d b = solid.face_normal(faces[1], p);
    const double cosine = a.dot(b);
    const double sine2 = 1.0 - cosine * cosine;
    const double da = solid.face_distance_m(faces[0], p);
    const double db = solid.face_distance_m(faces[1], p);
    p -= ((da - cosine * db) * a + (db - cosine * da) * b) / sine2;
  }
}

}  // namespace

FeatureGraph features_of(const std::vector<std::vector<Vector3d>>& loops_m) {
  FeatureGraph graph;
  graph.sheets.push_back({[](const Vector3d& p) { return p.z(); },
                          [](const Vector3d&) -> Vector3d { return Vector3d::UnitZ(); }});
  for (const std::vector<Vector3d>& loop : loops_m) {
    const auto first = static_cast<std::uint32_t>(graph.corners_m.size());
    const auto n = static_cast<std::uint32_t>(loop.size());
    graph.corners_m.insert(graph.corners_m.end(), loop.begin(), loop.end());
    for (std::uint32_t i = 0; i < n; ++i) {
      FeatureGraph::Crease crease;
      crease.path_m = {loop[i], loop[(i + 1) % n]};
      crease.corner = {first + i, first + (i + 1) % n};
      crease.sides = {{0, true}};
      graph.creases.push_back(std::move(crease));
    }
  }
  return graph;
}

std::vector<Vector3d> divided(const FeatureGraph& graph, const FeatureGraph::Crease& crease,
                              const Solid* solid, const SizeFunction& size_m) {
  std::vector<Vector3d> path = crease.path_m;
  if (crease.closed) path.push_back(path.front());
  // Straight ones need places in between for a size that changes along them.
  if (path.size() == 2) {
    const Vector3d a = path[0];
    const Vector3d b = path[1];
    path = {a};
    constexpr int kParts = 64;
    for (int i = 1; i < kParts; ++i) path.push_back(a + (b - a) * (1.0 * i / kParts));
    path.push_back(b);
  }
  std::vector<double> edges = {0.0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector3d middle = 0.5 * (path[i] + path[i - 1]);
    edges.push_back(edges.back() + (path[i] - path[i - 1]).norm() / size_m(middle));
  }
  const double fewest =
      std::max(std::ceil(turning_rad(path) / kMostTurn_rad), crease.closed ? 3.0 : 1.0);
  const auto count = static_cast<std::size_t>(std::max(fewest, std::round(edges.back())));
  std::vector<Vector3d> out = {path.front()};
  std::size_t at = 1;
  for (std::size_t k = 1; k < count; ++k) {
    const double wanted = edges.back() * static_cast<double>(k) / static_cast<double>(count);
    while (edges[at] < wanted) ++at;
    const double share = (wanted - edges[at - 1]) / (edges[at] - edges[at - 1]);
    Vector3d p = path[at - 1] + share * (path[at] - path[at - 1]);
    if (solid != nullptr) settle_on_faces(*solid, crease.faces, p);
    out.push_back(p);
  }
  if (!crease.closed) {
    out.front() = graph.corners_m[crease.corner[0]];
    out.push_back(graph.corners_m[crease.corner[1]]);
  }
  return out;
}

}  // namespace engine
