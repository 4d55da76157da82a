#include "engine/scene/sdf/surface_truss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr int kNewtonSteps = 12;
constexpr double kOnSheet = 1e-10;  ///< of the reach
constexpr double kPressure = 1.1;
constexpr double kTimeStep = 0.2;
/// A surface's edges flip without end by a hair, so that still is less still than in a plane.
constexpr double kStill = 1e-2;
constexpr int kShapeEvery = 5;   ///< iterations between two rounds of flips
constexpr int kSizesUntil = 60;  ///< no splits or collapses after that: it would never settle
constexpr double kTooLong = 1.45;
constexpr double kTooShort = 0.55;
constexpr double kLargestStep = 0.2;  ///< in edges
/// So many iterations may pass without the largest move becoming smaller than it ever was.
constexpr int kPatience = 50;
constexpr int kMendRounds = 12;

double edge_share(const WorkMesh& mesh, const WorkMesh::Edge& e, const SizeFunction& size_m) {
  const Vector3d& a = mesh.place(e.a);
  const Vector3d& b = mesh.place(e.b);
  return (a - b).norm() / size_m(0.5 * (a + b));
}

/// To the nearest place on its sheet.
bool move_on(WorkMesh& mesh, const std::vector<Sheet>& sheets, std::uint32_t v, Vector3d place_m,
             double reach_m) {
  const Sheet& sheet = sheets[mesh.vertex(v).sheet];
  return settle_on(sheet, reach_m, place_m) && mesh.move(v, place_m, sheet.normal(place_m));
}

/// The vertex that may go onto the other, or nobody's.
bool collapse_either(WorkMesh& mesh, const WorkMesh::Edge& e) {
  const auto free = [&](std::uint32_t v) { return mesh.vertex(v).hold == WorkMesh::Hold::kFree; };
  if (free(e.a) && mesh.collapse(e.a, e.b)) return true;
  if (free(e.b) && mesh.collapse(e.b, e.a)) return true;
  return false;
}

bool gone(const WorkMesh& mesh, const WorkMesh::Edge& e) {
  const auto& fan = mesh.round(e.a);
  return std::none_of(fan.begin(), fan.end(), [&](std::uint32_t t) {
    const Corners& c = mesh.triangles()[t];
    return std::find(c.begin(), c.end(), e.b) != c.end();
  });
}

void right_sizes(WorkMesh& mesh, const std::vector<Sheet>& sheets, const SizeFunction& size_m) {
  for (const WorkMesh::Edge& e : mesh.edges()) {
    if (gone(mesh, e)) continue;
    const double share = edge_share(mesh, e, size_m);
    if (share < kTooShort) collapse_either(mesh, e);
    if (share <= kTooLong) continue;
    Vector3d middle = 0.5 * (mesh.place(e.a) + mesh.place(e.b));
    const double reach = 0.5 * (mesh.place(e.a) - mesh.place(e.b)).norm();
    const std::uint32_t sheet = mesh.sheet_at(e);
    if (settle_on(sheets[sheet], reach, middle)) mesh.split(e, middle);
  }
}

std::size_t flip_all(WorkMesh& mesh) {
  std::size_t flips = 0;
  for (int round = 0; round < 3; ++round) {
    std::size_t now = 0;
    for (const WorkMesh::Edge& e : mesh.edges())
      if (!gone(mesh, e) && mesh.flip(e, false)) ++now;
    flips += now;
    if (now == 0) break;
  }
  return flips;
}

/// The largest move, in edges.
double push(WorkMesh& mesh, const std::vector<Sheet>& sheets, const SizeFunction& size_m,
            const std::vector<WorkMesh::Edge>& bars) {
  std::vector<double> wanted(bars.size());
  double wanted2 = 0;
  double length2 = 0;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const Vector3d& a = mesh.place(bars[i].a);
    const Vector3d& b = mesh.place(bars[i].b);
    wanted[i] = size_m(0.5 * (a + b));
    wanted2 += wanted[i] * wanted[i];
    length2 += (a - b).squaredNorm();
  }
  if (!(wanted2 > 0.0)) return 0.0;
  const double scale = kPressure * std::sqrt(length2 / wanted2);
  std::vector<Vector3d> force(mesh.vertices(), Vector3d::Zero());
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const Vector3d along = mesh.place(bars[i].a) - mesh.place(bars[i].b);
    const double length = along.norm();
    const double more = scale * wanted[i] - length;
    if (more <= 0.0 || length == 0.0) continue;
    force[bars[i].a] += more / length * along;
    force[bars[i].b] -= more / length * along;
  }
  double largest = 0;
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    WorkMesh::Vertex& vertex = mesh.vertex(v);
    if (vertex.hold != WorkMesh::Hold::kFree || mesh.round(v).empty()) continue;
    const double h = size_m(vertex.place_m);
    const Vector3d n = sheets[vertex.sheet].normal(vertex.place_m);
    Vector3d move = kTimeStep * (force[v] - force[v].dot(n) * n);
    if (move.norm() > kLargestStep * h) move *= kLargestStep * h / move.norm();
    if (move_on(mesh, sheets, v, vertex.place_m + move, h))
      largest = std::max(largest, move.norm() / h);
  }
  return largest;
}

/// To the middle of its neighbours, where that makes the worst triangle there better.
void nudge(WorkMesh& mesh, const std::vector<Sheet>& sheets, std::uint32_t v) {
  WorkMesh::Vertex& vertex = mesh.vertex(v);
  if (vertex.hold != WorkMesh::Hold::kFree || mesh.round(v).empty()) return;
  const std::vector<std::uint32_t> ring = mesh.neighbours(v);
  Vector3d middle = Vector3d::Zero();
  for (const std::uint32_t n : ring) middle += mesh.place(n) / static_cast<double>(ring.size());
  const Vector3d before = vertex.place_m;
  const double worst = mesh.worst_round(v);
  const double reach = (middle - before).norm() + (mesh.place(ring[0]) - before).norm();
  for (const double share : {1.0, 0.5, 0.25}) {
    const Vector3d place = before + share * (middle - before);
    if (!move_on(mesh, sheets, v, place, reach)) continue;
    if (mesh.worst_round(v) > worst + 1e-9) return;
    mesh.vertex(v).place_m = before;
  }
}

/// A collapse that makes nothing worse than it was.
void collapse_shortest(WorkMesh& mesh, std::uint32_t t) {
  const Corners c = mesh.triangles()[t];
  std::array<std::size_t, 3> order = {0, 1, 2};
  const auto length = [&](std::size_t i) {
    return (mesh.place(c[i]) - mesh.place(c[(i + 1) % 3])).squaredNorm();
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return length(i) < length(j); });
  for (const std::size_t i : order) {
    for (const auto& [from, to] :
         {std::pair(c[i], c[(i + 1) % 3]), std::pair(c[(i + 1) % 3], c[i])}) {
      const double worst = std::min(mesh.worst_round(from), mesh.worst_round(to));
      if (mesh.worst_after_collapse(from, to) > worst && mesh.collapse(from, to)) return;
    }
  }
}

}  // namespace

Sheet sheet_of(const DistanceFunction& f, double step_m) {
  return {f, [f, step_m](const Vector3d& p) -> Vector3d {
            const Vector3d g = slope(f, p, step_m);
            const double length = g.norm();
            return length > 0.0 && std::isfinite(length) ? Vector3d(g / length) : Vector3d::Zero();
          }};
}

bool settle_on(const Sheet& sheet, double reach_m, Vector3d& p_m) {
  Vector3d p = p_m;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double d = sheet.distance_m(p);
    if (std::abs(d) <= kOnSheet * reach_m) {
      p_m = p;
      return true;
    }
    p -= d * sheet.normal(p);
    if (!((p - p_m).norm() <= reach_m)) return false;
  }
  if (!(std::abs(sheet.distance_m(p)) <= 1e-6 * reach_m)) return false;
  p_m = p;
  return true;
}

WorkMesh thinned(const MarchedSurface& raw, const SizeFunction& size_m, std::uint64_t seed) {
  WorkMesh mesh;
  for (const Vector3d& p : raw.places_m) mesh.add_vertex({p, 0, WorkMesh::Hold::kFree});
  for (const Corners& t : raw.triangles) mesh.add_triangle(t);
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    double area = 0;
    for (const std::uint32_t t : mesh.round(v)) {
      const Corners& c = mesh.triangles()[t];
      area += area_vector(mesh.place(c[0]), mesh.place(c[1]), mesh.place(c[2])).norm() / 3.0;
    }
    // Even triangles have one vertex to each .866 of the size's square.
    const double kept = area / (std::sqrt(0.75) * std::pow(size_m(mesh.place(v)), 2));
    if (Draws(seed, Stream::kMeshSeeds, 1, v).uniform_double() < kept) continue;
    std::vector<std::uint32_t> ring = mesh.neighbours(v);
    std::sort(ring.begin(), ring.end(), [&](std::uint32_t a, std::uint32_t b) {
      return mesh.worst_after_collapse(v, a) > mesh.worst_after_collapse(v, b);
    });
    for (const std::uint32_t to : ring)
      if (mesh.collapse(v, to)) break;
  }
  return mesh;
}

TrussReport relax(WorkMesh& mesh, const std::vector<Sheet>& sheets, const SizeFunction& size_m,
                  int most_iterations) {
  TrussReport report;
  std::vector<WorkMesh::Edge> bars;
  double smallest_move = std::numeric_limits<double>::infinity();
  int best = 0;
  for (; report.iterations < most_iterations; ++report.iterations) {
    if (report.iterations % kShapeEvery == 0) {
      if (report.iterations < kSizesUntil) right_sizes(mesh, sheets, size_m);
      if (flip_all(mesh) > 0) ++report.triangulations;
      bars = mesh.edges();
    }
    report.last_move = push(mesh, sheets, size_m, bars);
    if (report.last_move < kStill && report.iterations >= kSizesUntil) {
      report.settled = true;
      break;
    }
    if (report.last_move < smallest_move) {
      smallest_move = report.last_move;
      best = report.iterations;
    }
    if (report.iterations - std::max(best, kSizesUntil) >= kPatience) {
      report.gave_up = true;
      break;
    }
  }
  flip_all(mesh);
  return report;
}

void mend(WorkMesh& mesh, const std::vector<Sheet>& sheets, double wanted) {
  for (int round = 0; round < kMendRounds; ++round) {
    std::vector<std::uint32_t> bad;
    for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t)
      if (mesh.alive(t) && mesh.quality(t) < wanted) bad.push_back(t);
    if (bad.empty()) return;
    for (const std::uint32_t t : bad) {
      const Corners c = mesh.triangles()[t];
      for (std::size_t i = 0; i < 3 && mesh.alive(t); ++i) mesh.flip({c[i], c[(i + 1) % 3]}, true);
      if (mesh.alive(t) && mesh.quality(t) < wanted) collapse_shortest(mesh, t);
      if (!mesh.alive(t)) continue;
      for (const std::uint32_t v : Corners(mesh.triangles()[t])) nudge(mesh, sheets, v);
    }
  }
}

}  // namespace engine
