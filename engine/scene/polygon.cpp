#include "engine/scene/polygon.h"

#include <algorithm>
#include <numeric>

#include <Eigen/Geometry>

namespace engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Index = std::uint32_t;
using Triangles = std::vector<std::array<Index, 3>>;

/// By Newell's method: right for dented faces, and the best there is for bent ones.
Vector3d face_normal(std::span<const Vector3f> corners) {
  Vector3d sum = Vector3d::Zero();
  const Vector3d origin = corners.front().cast<double>();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d a = corners[i].cast<double>() - origin;
    const Vector3d b = corners[(i + 1) % corners.size()].cast<double>() - origin;
    sum += a.cross(b);
  }
  return sum;
}

bool before(const Vector3f& a, const Vector3f& b) {
  return std::ranges::lexicographical_compare(a, b);
}

/// From the corner that comes first by its place: the same wherever the file begins.
std::vector<Index> from_first_place(std::span<const Vector3f> corners) {
  std::vector<Index> order(corners.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto first = std::ranges::min_element(
      order, [&](Index a, Index b) { return before(corners[a], corners[b]); });
  std::rotate(order.begin(), first, order.end());
  return order;
}

double twice_area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

bool cut_quad(std::span<const Vector3f> corners, const Vector3d& normal, Triangles& triangles) {
  const std::vector<Index> q = from_first_place(corners);
  const auto at = [&](std::size_t i) -> Vector3d { return corners[q[i]].cast<double>(); };
  const auto runs_along = [&](std::size_t a, std::size_t b, std::size_t c) {
    return (at(b) - at(a)).cross(at(c) - at(a)).dot(normal) > 0.0;
  };
  const bool even = runs_along(0, 1, 2) && runs_along(0, 2, 3);
  const bool odd = runs_along(0, 1, 3) && runs_along(1, 2, 3);
  const bool even_is_short = (at(2) - at(0)).squaredNorm() <= (at(3) - at(1)).squaredNorm();
  if (even && (even_is_short || !odd)) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  } else {
    triangles.push_back({q[0], q[1], q[3]});
    triangles.push_back({q[1], q[2], q[3]});
  }
  return even || odd;
}

/// The corners that are left of a face, in its plane.
class EarClipper {
 public:
  EarClipper(std::span<const Vector3f> corners, const Vector3d& normal)
      : left_(from_first_place(corners)),
        flat_(corners.size()),
        is_left_(corners.size(), true),
        known_outside_(corners.size(), 0) {
    const Vector3d u = normal.unitOrthogonal();
    const Vector3d v = normal.normalized().cross(u);
    const Vector3d origin = corners.front().cast<double>();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vector3d p = corners[i].cast<double>() - origin;
      flat_[i] = {u.dot(p), v.dot(p)};
    }
  }

  [[nodiscard]] bool clip(Triangles& triangles) {
    bool simple = true;
    std::size_t tip = 1;
    std::size_t tried = 0;
    while (left_.size() > 3) {
      const std::size_t n = left_.size();
      if (!is_ear(tip % n) && tried < n) {
        ++tip;
        ++tried;
        continue;
      }
      if (tried == n) simple = false;  // none is an ear: any will do
      take(tip % n, triangles);
      // The next corner but one: ears all round, no fan of needles.
      tip = tip % n + 1;
      tried = 0;
    }
    take(1, triangles);
    return simple;
  }

 private:
  [[nodiscard]] std::array<Index, 3> about(std::size_t tip) const {
    const std::size_t n = left_.size();
    return {left_[(tip + n - 1) % n], left_[tip], left_[(tip + 1) % n]};
  }
  void take(std::size_t tip, Triangles& triangles) {
    const auto [a, b, c] = about(tip);
    triangles.push_back({a, b, c});
    left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(tip));
    is_left_[b] = false;
    known_outside_[a] = known_outside_[c] = 0;
  }
  /// A tip's triangle changes only when a neighbour goes, and corners only ever go. So the search
  /// for one that lies in it goes on where it stopped: some 3 n^2 steps for all of them.
  [[nodiscard]] bool is_ear(std::size_t tip) {
    const auto [a, b, c] = about(tip);
    if (!(twice_area(flat_[a], flat_[b], flat_[c]) > 0.0)) return false;
    Index& i = known_outside_[b];
    while (i < flat_.size() && !(is_left_[i] && lies_in(i, {a, b, c}))) ++i;
    return i == flat_.size();
  }
  [[nodiscard]] bool lies_in(Index i, const std::array<Index, 3>& triangle) const {
    const auto& [a, b, c] = triangle;
    if (i == a || i == b || i == c) return false;
    const Vector2d& p = flat_[i];
    // A second corner at the same place: where the outline of a hole is let in.
    if (p == flat_[a] || p == flat_[b] || p == flat_[c]) return false;
    return twice_area(flat_[a], flat_[b], p) >= 0.0 && twice_area(flat_[b], flat_[c], p) >= 0.0 &&
           twice_area(flat_[c], flat_[a], p) >= 0.0;
  }

  std::vector<Index> left_;
  std::vector<Vector2d> flat_;
  std::vector<bool> is_left_;
  std::vector<Index> known_outside_;  ///< by tip: all corners before this one
};

void cut_fan(std::size_t corners, Triangles& triangles) {
  for (Index i = 2; i < corners; ++i) triangles.push_back({0, i - 1, i});
}

bool all_on_a_line(std::span<const Vector3f> corners) {
  for (std::size_t i = 2; i < corners.size(); ++i)
    if (face_normal(std::array{corners[0], corners[i - 1], corners[i]}).squaredNorm() > 0.0)
      return false;
  return true;
}

/// Those that are not at the place of the next one.
std::vector<Index> without_repeats(std::span<const Vector3f> corners) {
  std::vector<Index> kept;
  for (Index i = 0; i < corners.size(); ++i)
    if (corners[i] != corners[(i + 1) % corners.size()]) kept.push_back(i);
  return kept;
}

bool cut_without_repeats(std::span<const Vector3f> corners, const std::vector<Index>& kept,
                         Triangles& triangles) {
  std::vector<Vector3f> places;
  places.reserve(kept.size());
  for (const Index i : kept) places.push_back(corners[i]);
  const std::size_t first = triangles.size();
  const bool simple = cut_polygon(places, triangles);
  for (auto& triangle : std::span(triangles).subspan(first))
    for (Index& corner : triangle) corner = kept[corner];
  return simple;
}

}  // namespace

bool cut_polygon(std::span<const Vector3f> corners, Triangles& triangles) {
  const auto is_finite = [](const Vector3f& corner) { return corner.allFinite(); };
  if (corners.size() == 3 || !std::ranges::all_of(corners, is_finite)) {
    cut_fan(corners.size(), triangles);
    return true;
  }
  const std::vector<Index> kept = without_repeats(corners);
  if (kept.size() >= 3 && kept.size() < corners.size())
    return cut_without_repeats(corners, kept, triangles);
  const Vector3d normal = face_normal(corners);
  if (!(normal.squaredNorm() > 0.0)) {
    cut_fan(corners.size(), triangles);
    return all_on_a_line(corners);
  }
  return corners.size() == 4 ? cut_quad(corners, normal, triangles)
                             : EarClipper(corners, normal).clip(triangles);
}

}  // namespace engine
