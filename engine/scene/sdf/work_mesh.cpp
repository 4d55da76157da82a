#include "engine/scene/sdf/work_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace engine {
namespace {

using Eigen::Vector3d;

/// A face that turns further than this when a vertex moves has folded: 78 degrees.
constexpr double kFoldCosine = 0.2;
constexpr double kSliver = 0.01;  ///< area, of the longest side's square

double cosine_at(const Vector3d& apex, const Vector3d& a, const Vector3d& b) noexcept {
  return (a - apex).dot(b - apex) / ((a - apex).norm() * (b - apex).norm());
}

bool same_side(const Vector3d& before, const Vector3d& after) noexcept {
  return after.dot(before) > kFoldCosine * after.norm() * before.norm();
}

}  // namespace

double radius_ratio(const Vector3d& a, const Vector3d& b, const Vector3d& c) noexcept {
  const double x = (b - c).norm();
  const double y = (c - a).norm();
  const double z = (a - b).norm();
  const double product = x * y * z;
  // 2 r / R = (y + z - x)(z + x - y)(x + y - z) / (x y z), by Heron.
  return product > 0.0 ? std::max(0.0, (y + z - x) * (z + x - y) * (x + y - z) / product) : 0.0;
}

Vector3d area_vector(const Vector3d& a, const Vector3d& b, const Vector3d& c) noexcept {
  return 0.5 * (b - a).cross(c - a);
}

std::uint64_t WorkMesh::key(std::uint32_t a, std::uint32_t b) noexcept {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

std::uint32_t WorkMesh::add_vertex(const Vertex& vertex) {
  vertices_.push_back(vertex);
  round_.emplace_back();
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

void WorkMesh::attach(std::uint32_t t) {
  for (const std::uint32_t v : triangles_[t]) round_[v].push_back(t);
}

void WorkMesh::detach(std::uint32_t t) {
  for (const std::uint32_t v : triangles_[t]) std::erase(round_[v], t);
}

void WorkMesh::add_triangle(const Corners& corners, std::uint32_t sheet) {
  triangles_.push_back(corners);
  sheet_.push_back(sheet);
  attach(static_cast<std::uint32_t>(triangles_.size() - 1));
}

void WorkMesh::append(const WorkMesh& other, std::uint32_t sheet) {
  const auto first = static_cast<std::uint32_t>(vertices_.size());
  for (Vertex vertex : other.vertices_) {
    vertex.sheet = sheet;
    add_vertex(vertex);
  }
  for (std::uint32_t t = 0; t < other.triangles_.size(); ++t) {
    const Corners& c = other.triangles_[t];
    if (other.alive(t)) add_triangle({first + c[0], first + c[1], first + c[2]}, sheet);
  }
}

void WorkMesh::hold_rims() {
  for (const Edge& e : edges()) {
    if (at_edge(e.a, e.b).size() != 1) continue;
    lock(e.a, e.b);
    for (const std::uint32_t v : {e.a, e.b})
      if (vertices_[v].hold == Hold::kFree) vertices_[v].hold = Hold::kSlides;
  }
}

double WorkMesh::quality(std::uint32_t t) const noexcept {
  const Corners& c = triangles_[t];
  return radius_ratio(place(c[0]), place(c[1]), place(c[2]));
}

double WorkMesh::worst_round(std::uint32_t v) const noexcept {
  double worst = 1.0;
  for (const std::uint32_t t : round_[v]) worst = std::min(worst, quality(t));
  return worst;
}

std::vector<WorkMesh::Edge> WorkMesh::edges() const {
  std::vector<Edge> all;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    if (!alive(t)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangles_[t][i];
      const std::uint32_t b = triangles_[t][(i + 1) % 3];
      if (a < b) {
        all.push_back({a, b});
      } else if (at_edge(a, b).size() == 1) {
        all.push_back({b, a});  // a rim, which no other triangle walks the other way
      }
    }
  }
  return all;
}

std::vector<std::uint32_t> WorkMesh::neighbours(std::uint32_t v) const {
  std::vector<std::uint32_t> all;
  for (const std::uint32_t t : round_[v])
    for (const std::uint32_t c : triangles_[t])
      if (c != v) all.push_back(c);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::vector<std::uint32_t> WorkMesh::at_edge(std::uint32_t a, std::uint32_t b) const {
  std::vector<std::uint32_t> both;
  for (const std::uint32_t t : round_[a]) {
    const Corners& c = triangles_[t];
    if (std::find(c.begin(), c.end(), b) != c.end()) both.push_back(t);
  }
  return both;
}

std::uint32_t WorkMesh::across(std::uint32_t t, std::uint32_t a, std::uint32_t b) const noexcept {
  for (const std::uint32_t c : triangles_[t])
    if (c != a && c != b) return c;
  return a;
}

bool WorkMesh::flip(const Edge& edge, bool for_quality) {
  if (locked(edge.a, edge.b)) return false;
  const std::vector<std::uint32_t> pair = at_edge(edge.a, edge.b);
  if (pair.size() != 2) return false;
  // The first triangle walks from a to b.
  std::uint32_t a = edge.a;
  std::uint32_t b = edge.b;
  const Corners& first = triangles_[pair[0]];
  for (std::size_t i = 0; i < 3; ++i)
    if (first[i] == b && first[(i + 1) % 3] == a) std::swap(a, b);
  const std::uint32_t c = across(pair[0], a, b);
  const std::uint32_t d = across(pair[1], a, b);
  if (c == d || !at_edge(c, d).empty()) return false;
  const double worse = std::min(quality(pair[0]), quality(pair[1]));
  const double worse_after = std::min(radius_ratio(place(a), place(d), place(c)),
                                      radius_ratio(place(d), place(b), place(c)));
  if (for_quality) {
    if (worse_after <= worse + 1e-9) return false;
  } else {
    // Of two angles that make half a turn the cosines cancel.
    const double sum =
        cosine_at(place(c), place(a), place(b)) + cosine_at(place(d), place(a), place(b));
    if (sum >= -1e-9 || worse_after < 1e-3) return false;
  }
  const Vector3d before =
      area_vector(place(a), place(b), place(c)) + area_vector(place(b), place(a), place(d));
  if (!same_side(before, area_vector(place(a), place(d), place(c))) ||
      !same_side(before, area_vector(place(d), place(b), place(c)))) {
    return false;
  }
  for (const std::uint32_t t : pair) detach(t);
  triangles_[pair[0]] = {a, d, c};
  triangles_[pair[1]] = {d, b, c};
  for (const std::uint32_t t : pair) attach(t);
  return true;
}

bool WorkMesh::turns_over(std::uint32_t v, const Corners& old, const Vector3d& place_m) const {
  std::array<Vector3d, 3> p = {place(old[0]), place(old[1]), place(old[2])};
  const Vector3d before = area_vector(p[0], p[1], p[2]);
  const double longest2 = std::max(
      {(p[0] - p[1]).squaredNorm(), (p[1] - p[2]).squaredNorm(), (p[2] - p[0]).squaredNorm()});
  const bool sliver = before.norm() < kSliver * longest2;
  for (std::size_t i = 0; i < 3; ++i)
    if (old[i] == v) p[i] = place_m;
  const Vector3d after = area_vector(p[0], p[1], p[2]);
  if (!sliver) return !same_side(before, after);
  // Which way a sliver looks says little: its neighbours are asked.
  Vector3d all = Vector3d::Zero();
  for (const std::uint32_t t : round_[v]) {
    const Corners& c = triangles_[t];
    all += area_vector(place(c[0]), place(c[1]), place(c[2]));
  }
  return !same_side(all, after);
}

double WorkMesh::worst_after_collapse(std::uint32_t from, std::uint32_t to) const {
  double worst = 1.0;
  for (const std::uint32_t t : round_[from]) {
    Corners c = triangles_[t];
    if (std::find(c.begin(), c.end(), to) != c.end()) continue;
    std::replace(c.begin(), c.end(), from, to);
    worst = std::min(worst, radius_ratio(place(c[0]), place(c[1]), place(c[2])));
  }
  return worst;
}

bool WorkMesh::move(std::uint32_t v, const Vector3d& place_m, const Vector3d& up) {
  for (const std::uint32_t t : round_[v]) {
    const Corners& c = triangles_[t];
    if (turns_over(v, c, place_m)) return false;
    std::array<Vector3d, 3> p = {place(c[0]), place(c[1]), place(c[2])};
    const double before = area_vector(p[0], p[1], p[2]).dot(up);
    for (std::size_t i = 0; i < 3; ++i)
      if (c[i] == v) p[i] = place_m;
    const Vector3d after = area_vector(p[0], p[1], p[2]);
    if (after.dot(up) < kFoldCosine * after.norm() && after.dot(up) <= before) return false;
  }
  vertices_[v].place_m = place_m;
  return true;
}

bool WorkMesh::folds(std::uint32_t from, std::uint32_t to) const {
  return std::any_of(round_[from].begin(), round_[from].end(), [&](std::uint32_t t) {
    const Corners& c = triangles_[t];
    return std::find(c.begin(), c.end(), to) == c.end() && turns_over(from, c, place(to));
  });
}

bool WorkMesh::collapse(std::uint32_t from, std::uint32_t to) {
  const Hold hold = vertices_[from].hold;
  if (hold == Hold::kFixed || (hold == Hold::kSlides && !locked(from, to))) return false;
  const std::vector<std::uint32_t> gone = at_edge(from, to);
  if (gone.empty() || gone.size() > 2) return false;
  // The link condition (Dey, Edelsbrunner et al. 1999): no common neighbours but the two across.
  const std::vector<std::uint32_t> a = neighbours(from);
  const std::vector<std::uint32_t> b = neighbours(to);
  std::vector<std::uint32_t> common;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
  if (common.size() != gone.size() || a.size() + b.size() < gone.size() + 6) return false;
  if (folds(from, to)) return false;
  // Along a crease the edges that hung on `from` are the crease's.
  if (hold == Hold::kSlides) {
    for (const std::uint32_t v : a)
      if (v != to && locked(from, v)) lock(to, v);
  }
  for (const std::uint32_t v : a) locked_.erase(key(from, v));
  const std::vector<std::uint32_t> fan = round_[from];
  for (const std::uint32_t t : fan) {
    detach(t);
    if (std::find(gone.begin(), gone.end(), t) != gone.end()) {
      triangles_[t] = {from, from, from};
      continue;
    }
    std::replace(triangles_[t].begin(), triangles_[t].end(), from, to);
    attach(t);
  }
  return true;
}

bool WorkMesh::split(const Edge& edge, const Vector3d& place_m) {
  if (locked(edge.a, edge.b)) return false;
  const std::vector<std::uint32_t> pair = at_edge(edge.a, edge.b);
  if (pair.size() != 2) return false;
  for (const std::uint32_t t : pair) {
    Corners left = triangles_[t];
    const Vector3d before = area_vector(place(left[0]), place(left[1]), place(left[2]));
    for (const std::uint32_t end : {edge.a, edge.b}) {
      std::array<Vector3d, 3> p = {place(left[0]), place(left[1]), place(left[2])};
      for (std::size_t i = 0; i < 3; ++i)
        if (left[i] == end) p[i] = place_m;
      if (!same_side(before, area_vector(p[0], p[1], p[2]))) return false;
    }
  }
  const std::uint32_t middle = add_vertex({place_m, sheet_[pair[0]], Hold::kFree});
  for (const std::uint32_t t : pair) {
    detach(t);
    Corners other = triangles_[t];
    std::replace(triangles_[t].begin(), triangles_[t].end(), edge.a, middle);
    std::replace(other.begin(), other.end(), edge.b, middle);
    attach(t);
    add_triangle(other, sheet_[t]);
  }
  return true;
}

}  // namespace engine
