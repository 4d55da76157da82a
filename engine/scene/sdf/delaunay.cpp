#include "engine/scene/sdf/delaunay.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace engine {
namespace {

using Eigen::Vector3d;
using Wide = __int128;

constexpr double kSteps = 0x1p24;
/// The first triangle's corners are so far out: 2^27 leaves room for four factors in 128 bits.
constexpr std::int64_t kFar = std::int64_t{1} << 27;
constexpr int kNobody = -1;

struct Place {
  std::int64_t x = 0;
  std::int64_t y = 0;
  bool operator==(const Place&) const = default;
};

/// Positive where a, b, c run anticlockwise.
std::int64_t turn(const Place& a, const Place& b, const Place& c) noexcept {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Whether d lies inside the circle through a, b, c, which run anticlockwise.
bool in_circle(const Place& a, const Place& b, const Place& c, const Place& d) noexcept {
  const std::array<Place, 3> from = {Place{a.x - d.x, a.y - d.y}, Place{b.x - d.x, b.y - d.y},
                                     Place{c.x - d.x, c.y - d.y}};
  Wide sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Place& p = from[i];
    const Place& q = from[(i + 1) % 3];
    const Place& r = from[(i + 2) % 3];
    sum += static_cast<Wide>(p.x * p.x + p.y * p.y) * (q.x * r.y - q.y * r.x);
  }
  return sum > 0;
}

/// Triangles with their neighbours: neighbour i is across the edge that faces corner i.
class Triangulation {
 public:
  explicit Triangulation(std::vector<Place> places) : places_(std::move(places)) {
    const auto n = static_cast<std::uint32_t>(places_.size());
    places_.insert(places_.end(), {{-kFar, -kFar}, {kFar, -kFar}, {0, kFar}});
    triangles_.push_back({{n, n + 1, n + 2}, {kNobody, kNobody, kNobody}});
  }

  void insert(std::uint32_t vertex);
  [[nodiscard]] std::vector<Corners> inner() const;

 private:
  struct Triangle {
    Corners corner{};
    std::array<int, 3> next{};
  };
  [[nodiscard]] Triangle& at(int t) { return triangles_[static_cast<std::size_t>(t)]; }
  [[nodiscard]] const Place& place(int t, std::size_t i) { return places_[at(t).corner[i % 3]]; }
  void replace(int triangle, int old_neighbour, int new_neighbour) {
    if (triangle == kNobody) return;
    for (int& n : at(triangle).next)
      if (n == old_neighbour) n = new_neighbour;
  }
  void split(int t, std::uint32_t vertex);
  void settle();

  std::vector<Place> places_;
  std::vector<Triangle> triangles_;
  std::vector<int> doubtful_;  ///< whose edge across from corner 0, the new vertex, may be wrong
  int last_ = 0;
};

void Triangulation::insert(std::uint32_t vertex) {
  const Place& p = places_[vertex];
  int t = last_;
  // A walk on a Delaunay triangulation never comes back (Edelsbrunner 1990).
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t i = 0; i < 3 && !moved; ++i) {
      if (turn(place(t, i + 1), place(t, i + 2), p) >= 0) continue;
      t = at(t).next[i];
      moved = true;
    }
  }
  last_ = t;
  for (std::size_t i = 0; i < 3; ++i)
    if (place(t, i) == p) return;
  split(t, vertex);
  settle();
}

/// A point on an edge makes a flat triangle there, which settle() flips away: the point lies
/// inside the circle of the triangle beyond.
void Triangulation::split(int t, std::uint32_t vertex) {
  const Triangle old = at(t);
  const auto fresh = static_cast<int>(triangles_.size());
  const std::array<int, 3> made = {t, fresh, fresh + 1};
  triangles_.resize(triangles_.size() + 2);
  for (std::size_t i = 0; i < 3; ++i) {
    at(made[i]) = {{vertex, old.corner[(i + 1) % 3], old.corner[(i + 2) % 3]},
                   {old.next[i], made[(i + 1) % 3], made[(i + 2) % 3]}};
    replace(old.next[i], t, made[i]);
    doubtful_.push_back(made[i]);
  }
}

void Triangulation::settle() {
  while (!doubtful_.empty()) {
    const int t = doubtful_.back();
    doubtful_.pop_back();
    const int other = at(t).next[0];
    if (other == kNobody) continue;
    std::size_t facing = 0;
    while (at(other).next[facing] != t) ++facing;
    const Triangle a = at(t);
    const Triangle b = at(other);
    const std::uint32_t apex = b.corner[facing];
    const bool flat = turn(place(t, 0), place(t, 1), place(t, 2)) == 0;
    if (!flat && !in_circle(place(t, 0), place(t, 1), place(t, 2), places_[apex])) continue;
    // Neighbour of b across its edge from a's corner 1 to the apex, and from the apex to corner 2.
    const int beyond_1 = b.next[(facing + 1) % 3];
    const int beyond_2 = b.next[(facing + 2) % 3];
    at(t) = {{a.corner[0], a.corner[1], apex}, {beyond_1, other, a.next[2]}};
    at(other) = {{a.corner[0], apex, a.corner[2]}, {beyond_2, a.next[1], t}};
    replace(beyond_1, other, t);
    replace(a.next[1], t, other);
    doubtful_.push_back(t);
    doubtful_.push_back(other);
  }
}

std::vector<Corners> Triangulation::inner() const {
  std::vector<Corners> all;
  const std::size_t real = places_.size() - 3;
  for (const Triangle& t : triangles_) {
    if (std::any_of(t.corner.begin(), t.corner.end(), [&](auto c) { return c >= real; })) continue;
    all.push_back(t.corner);
  }
  return all;
}

/// Neighbours in the order are neighbours in the plane: strips, up and down in turn.
std::vector<std::uint32_t> walking_order(const std::vector<Place>& places,
                                         std::vector<std::uint32_t> chosen) {
  const double strips = std::max(1.0, std::sqrt(0.5 * static_cast<double>(chosen.size())));
  const auto key = [&](std::uint32_t i) {
    const Place& p = places[i];
    const auto strip =
        static_cast<std::int64_t>((static_cast<double>(p.x) / kSteps + 0.5) * strips);
    return std::pair(strip, strip % 2 == 0 ? p.y : -p.y);
  };
  std::stable_sort(chosen.begin(), chosen.end(), [&](auto i, auto j) { return key(i) < key(j); });
  return chosen;
}

}  // namespace

std::vector<Corners> delaunay(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) continue;
    box.extend(points[i]);
    chosen.push_back(i);
  }
  if (chosen.size() < 3) return {};
  const double side_m = std::max(box.sizes().x(), box.sizes().y());
  if (!(side_m > 0.0)) return {};
  const double scale = (kSteps - 2.0) / side_m;
  std::vector<Place> places(points.size());
  for (const std::uint32_t i : chosen) {
    const Vector3d at = (points[i] - box.center()) * scale;
    places[i] = {std::llround(at.x()), std::llround(at.y())};
  }
  const std::vector<std::uint32_t> order = walking_order(places, std::move(chosen));
  Triangulation triangulation(std::move(places));
  for (const std::uint32_t vertex : order) triangulation.insert(vertex);
  return triangulation.inner();
}

}  // namespace engine
