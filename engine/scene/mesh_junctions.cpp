#include "engine/scene/mesh_junctions.h"

#include <algorithm>

#include "engine/scene/box_tree.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Together a second at most. More open edges than these is no surface, but a heap of triangles.
constexpr std::size_t kMostEdges = 1'000'000;
constexpr std::uint64_t kMostSteps = 20'000'000;  // some 30 for an edge whose box is its own

std::vector<MeshTopology::Edge> open_edges_of(const MeshTopology& topology) {
  std::vector<MeshTopology::Edge> open;
  std::ranges::copy_if(topology.odd_edges(), std::back_inserter(open),
                       [](const MeshTopology::Edge& edge) { return edge.uses == 1; });
  return open;
}

double squared_distance_m2(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double share = std::clamp(ab.dot(p - a) / ab.squaredNorm(), 0.0, 1.0);
  return (a + share * ab - p).squaredNorm();
}

/// Wider than `reach_m` by a float's last digit: none that is as close is missed.
BoxTree::Box box_about(const Vector3d& p, double reach_m) {
  constexpr float kRounding = 2.5e-7F;
  const Vector3d reach = Vector3d::Constant(reach_m);
  BoxTree::Box box{(p - reach).cast<float>(), (p + reach).cast<float>()};
  box.low -= kRounding * box.low.cwiseAbs();
  box.high += kRounding * box.high.cwiseAbs();
  return box;
}

}  // namespace

MeshJunctions junctions_of(const Mesh& mesh, const MeshTopology& topology, double weld_m) {
  const std::vector<MeshTopology::Edge> edges = open_edges_of(topology);
  if (edges.size() > kMostEdges) return {{}, false};
  const auto place = [&](std::uint32_t vertex) { return mesh.vertices[vertex].cast<double>(); };
  std::vector<BoxTree::Box> boxes;
  boxes.reserve(edges.size());
  std::vector<std::uint32_t> ends;
  for (const MeshTopology::Edge& edge : edges) {
    boxes.push_back({mesh.vertices[edge.vertex[0]], mesh.vertices[edge.vertex[0]]});
    boxes.back().extend(mesh.vertices[edge.vertex[1]]);
    ends.insert(ends.end(), edge.vertex.begin(), edge.vertex.end());
  }
  std::ranges::sort(ends);
  ends.erase(std::ranges::unique(ends).begin(), ends.end());

  const BoxTree tree(boxes);
  std::uint64_t steps = kMostSteps;
  MeshJunctions junctions;
  for (const std::uint32_t vertex : ends) {
    const Vector3d p = place(vertex);
    const BoxTree::Box reach = box_about(p, weld_m);
    std::uint32_t met = 0;
    const BoxTree::Found found =
        tree.any([&](const BoxTree::Box& box) { return box.touches(reach); },
                 [&](std::uint32_t i) {
                   met = edges[i].triangle;
                   return std::ranges::find(mesh.triangles[met].corner, vertex) ==
                              mesh.triangles[met].corner.end() &&
                          squared_distance_m2(p, place(edges[i].vertex[0]),
                                              place(edges[i].vertex[1])) <= weld_m * weld_m;
                 },
                 steps);
    if (found == BoxTree::Found::kYes) junctions.found.push_back({vertex, met});
    junctions.complete = found != BoxTree::Found::kGaveUp;
    if (!junctions.complete) break;
  }
  return junctions;
}

}  // namespace engine
