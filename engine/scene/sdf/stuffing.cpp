#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "engine/scene/sdf/marching.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr int kBisections = 40;
constexpr double kMostPlaces = 1e6;
/// A lattice point that is nearer than this share of an edge to the border is moved onto it.
constexpr double kPull = 0.25;
const double kRowHeight = std::sqrt(0.75);

/// Rows of even triangles; every second row is half a step to the right.
class EvenTriangles {
 public:
  EvenTriangles(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m, double step_m);
  [[nodiscard]] MarchedSurface region();

 private:
  struct Point {
    Vector3d place_m;
    int side = 1;  ///< -1 inside, 0 on the border
  };
  [[nodiscard]] std::uint32_t point(int column, int row) const noexcept {
    return static_cast<std::uint32_t>(row * columns_ + column);
  }
  [[nodiscard]] std::vector<Corners> lattice() const;
  /// From the point that is inside towards the other, in [0, 1].
  [[nodiscard]] double share(std::uint32_t inside, std::uint32_t outside) const;
  void pull_points(const std::vector<Corners>& cells);
  std::uint32_t cut(std::uint32_t a, std::uint32_t b);
  void clip(const Corners& cell);
  [[nodiscard]] MarchedSurface tidy() const;

  const DistanceFunction& f_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Point> points_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cuts_;
  std::vector<Corners> inside_;
  MarchReport report_;
};

EvenTriangles::EvenTriangles(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m,
                             double step_m)
    : f_(f) {
  const Vector3d sizes = box_m.sizes();
  report_.step_m =
      std::max({step_m, std::sqrt(sizes.x() * sizes.y() / kMostPlaces), sizes.maxCoeff() / 1e5});
  columns_ = static_cast<int>(sizes.x() / report_.step_m) + 4;
  rows_ = static_cast<int>(sizes.y() / (report_.step_m * kRowHeight)) + 4;
  const Vector3d low =
      box_m.center() - 0.5 * report_.step_m * Vector3d(columns_ - 0.5, (rows_ - 1) * kRowHeight, 0);
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      Point p;
      p.place_m = low + report_.step_m * Vector3d(c + 0.5 * (r % 2), r * kRowHeight, 0);
      p.place_m.z() = 0.0;
      const double v = f(p.place_m);
      if (!std::isfinite(v)) ++report_.not_finite;
      const bool side = r == 0 || c == 0 || r == rows_ - 1 || c == columns_ - 1;
      if (v < 0.0 && side) ++report_.inside_at_sides;
      if (v < 0.0 && !side) p.side = -1;
      points_.push_back(p);
    }
  }
}

std::vector<Corners> EvenTriangles::lattice() const {
  std::vector<Corners> cells;
  for (int r = 0; r + 1 < rows_; ++r) {
    for (int c = 0; c + 1 < columns_; ++c) {
      const std::array<std::uint32_t, 4> p = {point(c, r), point(c + 1, r), point(c, r + 1),
                                              point(c + 1, r + 1)};
      if (r % 2 == 0) {
        cells.push_back({p[0], p[1], p[2]});
        cells.push_back({p[1], p[3], p[2]});
      } else {
        cells.push_back({p[0], p[1], p[3]});
        cells.push_back({p[0], p[3], p[2]});
      }
    }
  }
  return cells;
}

double EvenTriangles::share(std::uint32_t inside, std::uint32_t outside) const {
  const Vector3d& a = points_[inside].place_m;
  const Vector3d along = points_[outside].place_m - a;
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (f_(a + middle * along) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Each to the nearest of the border's places on its edges; all are found before any is moved.
void EvenTriangles::pull_points(const std::vector<Corners>& cells) {
  std::map<std::uint32_t, std::pair<double, Vector3d>> pulled;
  const auto offer = [&](std::uint32_t p, double distance, const Vector3d& place) {
    if (distance > kPull) return;
    const auto [it, fresh] = pulled.try_emplace(p, distance, place);
    if (!fresh && distance < it->second.first) it->second = {distance, place};
  };
  for (const Corners& cell : cells) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = cell[i];
      const std::uint32_t b = cell[(i + 1) % 3];
      if (points_[a].side >= 0 || points_[b].side < 0) {
        if (points_[b].side >= 0 || points_[a].side < 0) continue;
      }
      const std::uint32_t in = points_[a].side < 0 ? a : b;
      const std::uint32_t out = in == a ? b : a;
      const double s = share(in, out);
      const Vector3d place = points_[in].place_m + s * (points_[out].place_m - points_[in].place_m);
      offer(in, s, place);
      offer(out, 1.0 - s, place);
    }
  }
  for (const auto& [p, pull] : pulled) points_[p] = {pull.second, 0};
}

std::uint32_t EvenTriangles::cut(std::uint32_t a, std::uint32_t b) {
  const auto fresh = static_cast<std::uint32_t>(points_.size());
  const auto [it, is_new] = cuts_.try_emplace(std::minmax(a, b), fresh);
  if (is_new) {
    const std::uint32_t in = points_[a].side < 0 ? a : b;
    const std::uint32_t out = in == a ? b : a;
    const double s = share(in, out);
    const Vector3d place = points_[in].place_m + s * (points_[out].place_m - points_[in].place_m);
    points_.push_back({place, 0});
  }
  return it->second;
}

void EvenTriangles::clip(const Corners& cell) {
  std::vector<std::uint32_t> ring;
  bool any_inside = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t a = cell[i];
    const std::uint32_t b = cell[(i + 1) % 3];
    any_inside = any_inside || points_[a].side < 0;
    if (points_[a].side <= 0) ring.push_back(a);
    if (points_[a].side * points_[b].side < 0) ring.push_back(cut(a, b));
  }
  if (!any_inside || ring.size() < 3) return;
  if (ring.size() == 4 && (points_[ring[0]].place_m - points_[ring[2]].place_m).norm() >
                              (points_[ring[1]].place_m - points_[ring[3]].place_m).norm()) {
    std::rotate(ring.begin(), ring.begin() + 1, ring.end());
  }
  inside_.push_back({ring[0], ring[1], ring[2]});
  if (ring.size() == 4) inside_.push_back({ring[0], ring[2], ring[3]});
}

/// Without the points that no triangle has.
MarchedSurface EvenTriangles::tidy() const {
  MarchedSurface out;
  out.report = report_;
  std::map<std::uint32_t, std::uint32_t> moved_to;
  for (Corners t : inside_) {
    for (std::uint32_t& c : t) {
      const auto [it, fresh] =
          moved_to.try_emplace(c, static_cast<std::uint32_t>(out.places_m.size()));
      if (fresh) out.places_m.push_back(points_[c].place_m);
      c = it->second;
    }
    out.triangles.push_back(t);
  }
  return out;
}

MarchedSurface EvenTriangles::region() {
  const std::vector<Corners> cells = lattice();
  pull_points(cells);
  for (const Corners& cell : cells) clip(cell);
  return tidy();
}

}  // namespace

MarchedSurface stuffed_region(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m,
                              double step_m) {
  return EvenTriangles(f, box_m, step_m).region();
}

}  // namespace engine
