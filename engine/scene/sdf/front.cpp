#include "engine/scene/sdf/front.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/constants.h"
#include "engine/scene/sdf/filled_hole.h"

namespace engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kEven_rad = 60.0 * kDegree;
/// An old vertex that is nearer than this to the ideal place, in edges, is taken in its stead.
constexpr double kSnap = 0.7;
/// How far, in edges, one looks for the front's other parts.
constexpr double kLook = 2.5;
/// A new vertex keeps so far, in edges, from the front's other edges.
constexpr double kRoom = 0.45;
/// Edges from one vertex are so far apart: else one lies on the other.
constexpr double kApart_rad = 0.03;
constexpr std::size_t kLargestHole = 16;  ///< edges round a hole that is filled at once
/// The quality that a triangle needs, the first time a corner of the front is tried, the second...
constexpr std::array<double, 4> kWanted = {0.4, 0.15, 0.03, 1e-4};

/// From one direction to another round a normal, in (0, 2 pi]; anticlockwise, both as they lie in
/// the tangent plane.
double angle_round(const Vector3d& n, const Vector3d& from, const Vector3d& to) noexcept {
  const double angle = std::atan2(n.dot(from.cross(to)), from.dot(to) - from.dot(n) * to.dot(n));
  return angle > 0.0 ? angle : angle + 2.0 * kPi;
}

/// The front of one sheet.
class Front {
 public:
  Front(const Sheet& sheet, std::uint32_t sheet_index, const SizeFunction& size_m, WorkMesh& mesh)
      : sheet_(sheet), index_(sheet_index), size_m_(size_m), mesh_(mesh) {}

  void add_edge(std::uint32_t a, std::uint32_t b);
  void add_tip(std::uint32_t v) { tips_.push_back(v); }
  /// False: an edge that nothing follows.
  [[nodiscard]] bool link();
  /// False: it does not close.
  [[nodiscard]] bool advance(std::size_t most_triangles);
  [[nodiscard]] std::size_t triangles() const noexcept { return made_; }

 private:
  struct Edge {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    std::size_t prev = 0;
    std::size_t next = 0;
    bool alive = true;
    std::size_t tried = 0;
    unsigned version = 0;
  };
  /// A vertex that a triangle could have: an old one with the edge that ends there, a tip, or a
  /// new place.
  struct Third {
    Vector3d place_m;
    std::optional<std::uint32_t> vertex;
    std::optional<std::size_t> edge;
    double order = 0;
  };
  using Entry = std::tuple<double, std::size_t, unsigned>;

  [[nodiscard]] const Vector3d& place(std::uint32_t v) const { return mesh_.place(v); }
  [[nodiscard]] double inner_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) const {
    return angle_round(sheet_.normal(b), c - b, a - b);
  }
  [[nodiscard]] double corner_angle(const Edge& e) const {
    return inner_angle(place(e.a), place(e.b), place(edges_[e.next].b));
  }
  void queue(std::size_t edge);
  void join(std::size_t first, std::size_t second) {
    edges_[first].next = second;
    edges_[second].prev = first;
  }
  /// Two edges that run back and forth are no front any more.
  void cancel(std::size_t edge);
  [[nodiscard]] std::vector<Third> thirds(std::size_t corner) const;
  [[nodiscard]] bool fits(std::size_t base, const Third& third, double wanted) const;
  [[nodiscard]] bool within_sectors(std::size_t base, const Third& third) const;
  [[nodiscard]] bool clear_of_front(std::size_t base, const Third& third) const;
  void make(std::size_t base, const Third& third);
  /// What is left where nothing fits: a tip's fan, or a small hole. False: it is not small.
  bool close_loop(std::size_t edge);

  const Sheet& sheet_;
  std::uint32_t index_;
  const SizeFunction& size_m_;
  WorkMesh& mesh_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> alive_;  ///< and some dead: swept now and then
  std::vector<std::uint32_t> tips_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  std::size_t made_ = 0;
};

void Front::add_edge(std::uint32_t a, std::uint32_t b) {
  edges_.push_back({a, b, 0, 0, true, 0, 0});
  alive_.push_back(edges_.size() - 1);
}

bool Front::link() {
  std::multimap<std::uint32_t, std::size_t> from;
  for (std::size_t i = 0; i < edges_.size(); ++i) from.emplace(edges_[i].a, i);
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const auto [low, high] = from.equal_range(edges_[i].b);
    if (low == high) return false;
    // Where the border touches itself, the piece between two edges is the sharper one.
    const auto sharpest = std::min_element(low, high, [&](const auto& x, const auto& y) {
      const auto angle = [&](std::size_t next) {
        return inner_angle(place(edges_[i].a), place(edges_[i].b), place(edges_[next].b));
      };
      return angle(x.second) < angle(y.second);
    });
    join(i, sharpest->second);
    from.erase(sharpest);
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) queue(i);
  return true;
}

void Front::queue(std::size_t edge) {
  Edge& e = edges_[edge];
  if (!e.alive) return;
  ++e.version;
  // What did not fit comes again when all others have had their turn.
  queue_.emplace(corner_angle(e) + 10.0 * static_cast<double>(e.tried), edge, e.version);
}

void Front::cancel(std::size_t edge) {
  while (edges_[edge].alive) {
    const std::size_t next = edges_[edge].next;
    if (edges_[next].b != edges_[edge].a) return;
    edges_[edge].alive = false;
    edges_[next].alive = false;
    const std::size_t after = edges_[next].next;
    const std::size_t before = edges_[edge].prev;
    if (after == edge) return;
    join(before, after);
    edge = before;
  }
}

/// Round the corner there is room for so many even triangles; the first of them stands on the
/// edge after it. In the order in which they are tried.
std::vector<Front::Third> Front::thirds(std::size_t corner) const {
  const Edge& e = edges_[corner];
  const Edge& base = edges_[e.next];
  const Vector3d& b = place(base.a);
  const Vector3d& c = place(base.b);
  const double angle = corner_angle(e);
  const double room = std::max(1.0, std::round(angle / kEven_rad));
  const double length = 0.5 * (size_m_(0.5 * (b + c)) + std::min((c - b).norm(), 1.5 * size_m_(b)));
  std::vector<Third> all;
  if (room == 1.0) all.push_back({place(e.a), e.a, e.prev, -1.0});
  const Eigen::AngleAxisd turn(angle / room, sheet_.normal(b));
  const Vector3d heading = turn * (c - b).normalized();
  Vector3d ideal = b + length * heading;
  const bool on_sheet = settle_on(sheet_, length, ideal);
  const double reach2 = std::pow(kLook * length, 2);
  for (const std::size_t i : alive_) {
    const Edge& other = edges_[i];
    if (!other.alive || other.b == base.a || other.b == base.b) continue;
    const double d2 = (place(other.b) - ideal).squaredNorm();
    if (d2 > reach2) continue;
    const double d = std::sqrt(d2) / length;
    all.push_back({place(other.b), other.b, i, d < kSnap ? d : 2.0 + d});
  }
  for (const std::uint32_t v : tips_) {
    const double d = (place(v) - ideal).norm() / length;
    if (d < kLook) all.push_back({place(v), v, std::nullopt, d < kSnap ? d : 2.0 + d});
  }
  for (const double share : {1.0, 0.75, 0.5}) {
    Vector3d p = share == 1.0 ? ideal : Vector3d(b + share * length * heading);
    if (share == 1.0 ? on_sheet : settle_on(sheet_, length, p))
      all.push_back({p, std::nullopt, std::nullopt, 2.0 - share});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Third& x, const Third& y) { return x.order < y.order; });
  return all;
}

/// Whether the new edges leave their ends on the sheet's side of the front.
bool Front::within_sectors(std::size_t base, const Third& third) const {
  const Edge& f = edges_[base];
  const auto inside = [&](const Edge& in, const Vector3d& towards,
                          const std::optional<std::uint32_t>& vertex) {
    const Edge& out = edges_[in.next];
    if (vertex == in.a || vertex == out.b) return true;
    const Vector3d& at = place(in.b);
    const Vector3d n = sheet_.normal(at);
    if (n.isZero(0.0)) return true;
    const Vector3d ahead = place(out.b) - at;
    const double whole = angle_round(n, ahead, place(in.a) - at);
    const double part = angle_round(n, ahead, towards - at);
    return part > kApart_rad && part < whole - kApart_rad;
  };
  if (!inside(edges_[f.prev], third.place_m, third.vertex) ||
      !inside(f, third.place_m, third.vertex)) {
    return false;
  }
  return !third.edge || (inside(edges_[*third.edge], place(f.a), f.a) &&
                         inside(edges_[*third.edge], place(f.b), f.b));
}

bool Front::clear_of_front(std::size_t base, const Third& third) const {
  const Edge& f = edges_[base];
  const Vector3d& q = third.place_m;
  const Vector3d middle = (place(f.a) + place(f.b) + q) / 3.0;
  const double length = std::max(
      {(place(f.a) - q).norm(), (place(f.b) - q).norm(), (place(f.a) - place(f.b)).norm()});
  // In the tangent plane; what lies above or below it belongs to another part of the sheet.
  const Vector3d n = area_vector(place(f.a), place(f.b), q).normalized();
  const Vector3d x = (place(f.b) - place(f.a)).normalized();
  const Vector3d y = n.cross(x);
  const auto flat = [&](const Vector3d& p) {
    return Vector2d((p - middle).dot(x), (p - middle).dot(y));
  };
  const auto turn = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
  };
  const Vector2d a2 = flat(place(f.a));
  const Vector2d b2 = flat(place(f.b));
  const Vector2d q2 = flat(q);
  const auto covered = [&](const Vector3d& p) {
    const Vector2d p2 = flat(p);
    return turn(a2, b2, p2) > 0.0 && turn(b2, q2, p2) > 0.0 && turn(q2, a2, p2) > 0.0;
  };
  const double reach2 = std::pow(kLook * length, 2);
  const auto near = [&](const Vector3d& p) {
    return (p - middle).squaredNorm() < reach2 && std::abs((p - middle).dot(n)) < length &&
           sheet_.normal(p).dot(n) > -0.2;
  };
  for (const std::uint32_t v : tips_)
    if (v != third.vertex && near(place(v)) && covered(place(v))) return false;
  for (const std::size_t i : alive_) {
    const Edge& other = edges_[i];
    if (!other.alive || i == base) continue;
    if (!near(place(other.a)) && !near(place(other.b))) continue;
    const bool own_end = other.b == f.a || other.b == f.b || other.b == third.vertex;
    if (!own_end && covered(place(other.b))) return false;
    const Vector2d s = flat(place(other.a));
    const Vector2d t = flat(place(other.b));
    for (const std::uint32_t end : {f.a, f.b}) {
      if (other.a == end || other.b == end || other.a == third.vertex || other.b == third.vertex)
        continue;
      const Vector2d e2 = end == f.a ? a2 : b2;
      if (turn(s, t, e2) * turn(s, t, q2) <= 0.0 && turn(e2, q2, s) * turn(e2, q2, t) <= 0.0)
        return false;
    }
    if (third.vertex) continue;
    const Vector2d along = t - s;
    const double share = std::clamp((q2 - s).dot(along) / along.squaredNorm(), 0.0, 1.0);
    if ((q2 - s - share * along).norm() < kRoom * std::min(length, size_m_(q))) return false;
  }
  return true;
}

bool Front::fits(std::size_t base, const Third& third, double wanted) const {
  const Edge& f = edges_[base];
  const Vector3d& a = place(f.a);
  const Vector3d& b = place(f.b);
  if (third.vertex && (*third.vertex == f.a || *third.vertex == f.b)) return false;
  if (radius_ratio(a, b, third.place_m) < wanted) return false;
  const Vector3d area = area_vector(a, b, third.place_m);
  const Vector3d n = sheet_.normal(0.5 * (a + b));
  if (area.dot(n) < 0.4 * area.norm()) return false;
  return within_sectors(base, third) && clear_of_front(base, third);
}

void Front::make(std::size_t base, const Third& third) {
  const std::uint32_t q = third.vertex
                              ? *third.vertex
                              : mesh_.add_vertex({third.place_m, index_, WorkMesh::Hold::kFree});
  if (third.vertex) std::erase(tips_, q);
  const Edge f = edges_[base];
  mesh_.add_triangle({f.a, f.b, q}, index_);
  ++made_;
  edges_[base].alive = false;
  const std::size_t to = edges_.size();
  const std::size_t back = to + 1;
  add_edge(f.a, q);
  add_edge(q, f.b);
  const std::size_t after_q = third.edge ? edges_[*third.edge].next : back;
  join(f.prev, to);
  join(back, f.next);
  join(to, after_q);
  if (third.edge) join(*third.edge, back);
  const std::vector<std::size_t> touched = {f.prev, to, back, f.next};
  cancel(to);
  cancel(back);
  if (edges_[to].alive) cancel(edges_[to].prev);
  if (edges_[back].alive) cancel(edges_[back].prev);
  for (const std::size_t i : touched) {
    for (const std::size_t at : {i, edges_[i].prev}) {
      edges_[at].tried = 0;
      queue(at);
    }
  }
}

bool Front::close_loop(std::size_t edge) {
  std::vector<std::uint32_t> hole;
  std::size_t at = edge;
  do {
    hole.push_back(edges_[at].a);
    at = edges_[at].next;
  } while (at != edge && hole.size() <= kLargestHole);
  if (hole.size() > kLargestHole) return false;
  const double reach = kLook * (place(hole[1]) - place(hole[0])).norm();
  const auto tip = std::find_if(tips_.begin(), tips_.end(), [&](std::uint32_t v) {
    return (place(v) - place(hole[0])).norm() < reach;
  });
  std::vector<Corners> fill;
  if (tip != tips_.end()) {
    for (std::size_t i = 0; i < hole.size(); ++i)
      fill.push_back({hole[i], hole[(i + 1) % hole.size()], *tip});
    tips_.erase(tip);
  } else {
    fill = filled_hole(mesh_, hole);
  }
  for (const Corners& t : fill) mesh_.add_triangle(t, index_);
  made_ += fill.size();
  for (std::size_t i = 0; i < hole.size(); ++i) {
    edges_[at].alive = false;
    at = edges_[at].next;
  }
  return true;
}

bool Front::advance(std::size_t most_triangles) {
  while (!queue_.empty()) {
    const auto [angle, corner, version] = queue_.top();
    queue_.pop();
    if (!edges_[corner].alive || edges_[corner].version != version) continue;
    if (made_ >= most_triangles) return false;
    if (alive_.size() > 64 && made_ % 64 == 0)
      std::erase_if(alive_, [&](std::size_t i) { return !edges_[i].alive; });
    const std::size_t base = edges_[corner].next;
    bool done = false;
    for (const Third& third : thirds(corner)) {
      if (!fits(base, third, kWanted[edges_[corner].tried])) continue;
      make(base, third);
      done = true;
      break;
    }
    if (done) continue;
    if (++edges_[corner].tried == kWanted.size()) {
      if (!close_loop(corner)) return false;
      continue;
    }
    queue(corner);
  }
  return true;
}

/// The vertices of every crease, corners shared.
std::vector<std::vector<std::uint32_t>> add_creases(const FeatureGraph& graph, const Solid* solid,
                                                    const SizeFunction& size_m, WorkMesh& mesh) {
  std::vector<std::uint32_t> corner;
  for (const Vector3d& p : graph.corners_m)
    corner.push_back(mesh.add_vertex({p, 0, WorkMesh::Hold::kFixed}));
  std::vector<std::vector<std::uint32_t>> all;
  for (const FeatureGraph::Crease& crease : graph.creases) {
    const std::vector<Vector3d> places = divided(graph, crease, solid, size_m);
    std::vector<std::uint32_t>& line = all.emplace_back();
    for (std::size_t i = 0; i < places.size(); ++i) {
      const bool first = !crease.closed && i == 0;
      const bool last = !crease.closed && i + 1 == places.size();
      line.push_back(first  ? corner[crease.corner[0]]
                     : last ? corner[crease.corner[1]]
                            : mesh.add_vertex({places[i], 0, WorkMesh::Hold::kSlides}));
    }
    if (crease.closed) line.push_back(line.front());
    for (std::size_t i = 1; i < line.size(); ++i) mesh.lock(line[i - 1], line[i]);
  }
  return all;
}

}  // namespace

FrontReport fill_by_front(const FeatureGraph& graph, const Solid* solid, const SizeFunction& size_m,
                          std::size_t most_triangles, WorkMesh& mesh) {
  const std::vector<std::vector<std::uint32_t>> lines = add_creases(graph, solid, size_m, mesh);
  FrontReport report;
  std::vector<std::uint32_t> tips;
  for (const FeatureGraph::Tip& tip : graph.tips)
    tips.push_back(mesh.add_vertex({tip.place_m, tip.sheet, WorkMesh::Hold::kFixed}));
  for (std::uint32_t s = 0; s < graph.sheets.size(); ++s) {
    if (std::count(graph.seamless.begin(), graph.seamless.end(), s) > 0) continue;
    Front front(graph.sheets[s], s, size_m, mesh);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (const FeatureGraph::Side& side : graph.creases[i].sides) {
        if (side.sheet != s) continue;
        for (std::size_t k = 1; k < lines[i].size(); ++k)
          side.on_left ? front.add_edge(lines[i][k - 1], lines[i][k])
                       : front.add_edge(lines[i][k], lines[i][k - 1]);
      }
    }
    for (std::size_t i = 0; i < tips.size(); ++i)
      if (graph.tips[i].sheet == s) front.add_tip(tips[i]);
    if (!front.link()) {
      report.failed = "a sheet's edges do not close";
      return report;
    }
    if (!front.advance(most_triangles - std::min(most_triangles, report.triangles))) {
      report.failed = "a front did not close";
      return report;
    }
    report.triangles += front.triangles();
  }
  return report;
}

}  // namespace engine
