#include "engine/scene/sdf/planar_truss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Of Persson & Strang, in edges: how still is still, when to triangulate again, how far out is out.
constexpr double kStill = 1e-3;
constexpr double kMoved = 0.1;
constexpr double kBorder = 1e-3;
constexpr double kPressure = 1.2;  ///< bars want to be so much longer than there is room for
constexpr double kTimeStep = 0.2;
/// So many iterations may pass without the largest move becoming smaller than it ever was.
constexpr int kPatience = 50;
const double kRowHeight = std::sqrt(0.75);

Vector3d plane_slope(const DistanceFunction& f, const Vector3d& p, double step_m) {
  const Vector3d x(step_m, 0, 0);
  const Vector3d y(0, step_m, 0);
  return Vector3d(f(p + x) - f(p - x), f(p + y) - f(p - y), 0) / (2.0 * step_m);
}

class Truss {
 public:
  Truss(const DistanceFunction& f, const SizeFunction& size_m, double smallest_m)
      : f_(f), size_m_(size_m), h_(smallest_m) {}

  void scatter(const Eigen::AlignedBox3d& box_m, const std::vector<Vector3d>& fixed,
               std::uint64_t seed);
  [[nodiscard]] PlanarTruss settle(int most_iterations) &&;

 private:
  void triangulate();
  [[nodiscard]] std::vector<Vector3d> forces() const;
  /// The largest move of a point inside, in edges.
  double step(const std::vector<Vector3d>& forces);

  const DistanceFunction& f_;
  const SizeFunction& size_m_;
  double h_;
  std::size_t fixed_ = 0;
  std::vector<Vector3d> p_;
  std::vector<Vector3d> triangulated_at_;
  std::vector<Corners> triangles_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> bars_;
};

void Truss::scatter(const Eigen::AlignedBox3d& box_m, const std::vector<Vector3d>& fixed,
                    std::uint64_t seed) {
  for (const Vector3d& p : fixed) p_.emplace_back(p.x(), p.y(), 0.0);
  fixed_ = p_.size();
  Draws draws(seed, Stream::kMeshSeeds, 0, 0);
  const Vector3d sizes = box_m.sizes();
  const auto rows = static_cast<int>(sizes.y() / (h_ * kRowHeight)) + 1;
  const auto columns = static_cast<int>(sizes.x() / h_) + 1;
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      Vector3d p = box_m.min() + h_ * Vector3d(c + 0.5 * (r % 2), r * kRowHeight, 0);
      p.z() = 0.0;
      if (!(f_(p) < kBorder * h_)) continue;
      // As many to an area as one over the square of the size.
      const double kept = std::pow(h_ / size_m_(p), 2);
      if (draws.uniform_double() > kept) continue;
      const bool near_fixed =
          std::any_of(p_.begin(), p_.begin() + static_cast<std::ptrdiff_t>(fixed_),
                      [&](const Vector3d& q) { return (p - q).squaredNorm() < 0.01 * h_ * h_; });
      if (!near_fixed) p_.push_back(p);
    }
  }
}

void Truss::triangulate() {
  triangulated_at_ = p_;
  triangles_.clear();
  bars_.clear();
  for (const Corners& t : delaunay(p_)) {
    const Vector3d middle = (p_[t[0]] + p_[t[1]] + p_[t[2]]) / 3.0;
    if (!(f_(middle) < -kBorder * h_)) continue;
    triangles_.push_back(t);
    for (std::size_t i = 0; i < 3; ++i) bars_.emplace_back(std::minmax(t[i], t[(i + 1) % 3]));
  }
  std::sort(bars_.begin(), bars_.end());
  bars_.erase(std::unique(bars_.begin(), bars_.end()), bars_.end());
}

std::vector<Vector3d> Truss::forces() const {
  std::vector<double> wanted(bars_.size());
  double wanted2 = 0;
  double length2 = 0;
  for (std::size_t i = 0; i < bars_.size(); ++i) {
    const Vector3d& a = p_[bars_[i].first];
    const Vector3d& b = p_[bars_[i].second];
    wanted[i] = size_m_(0.5 * (a + b));
    wanted2 += wanted[i] * wanted[i];
    length2 += (a - b).squaredNorm();
  }
  const double scale = kPressure * std::sqrt(length2 / wanted2);
  std::vector<Vector3d> force(p_.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < bars_.size(); ++i) {
    const Vector3d along = p_[bars_[i].first] - p_[bars_[i].second];
    const double length = along.norm();
    const double push = scale * wanted[i] - length;
    if (push <= 0.0 || length == 0.0) continue;
    force[bars_[i].first] += push / length * along;
    force[bars_[i].second] -= push / length * along;
  }
  return force;
}

double Truss::step(const std::vector<Vector3d>& forces) {
  double largest = 0;
  for (std::size_t i = fixed_; i < p_.size(); ++i) {
    const Vector3d before = p_[i];
    p_[i] += kTimeStep * forces[i];
    const double d = f_(p_[i]);
    if (d > 0.0) {
      const Vector3d g = plane_slope(f_, p_[i], 1e-6 * h_);
      const double g2 = g.squaredNorm();
      if (g2 > 1e-6) p_[i] -= d / g2 * g;
    }
    // A step that leads to no number, or far off, is none.
    if (!p_[i].allFinite() || (p_[i] - before).norm() > 2.0 * h_ || std::isnan(d)) p_[i] = before;
    if (d < -kBorder * h_) largest = std::max(largest, kTimeStep * forces[i].norm() / h_);
  }
  return largest;
}

PlanarTruss Truss::settle(int most_iterations) && {
  PlanarTruss out;
  double smallest_move = std::numeric_limits<double>::infinity();
  int best = 0;
  for (TrussReport& r = out.report; r.iterations < most_iterations; ++r.iterations) {
    bool moved = triangulated_at_.empty();
    for (std::size_t i = 0; i < triangulated_at_.size() && !moved; ++i)
      moved = (p_[i] - triangulated_at_[i]).norm() > kMoved * h_;
    if (moved) {
      triangulate();
      ++r.triangulations;
    }
    if (bars_.empty()) break;
    r.last_move = step(forces());
    if (r.last_move < kStill) {
      r.settled = true;
      break;
    }
    if (r.last_move < smallest_move) {
      smallest_move = r.last_move;
      best = r.iterations;
    }
    if (r.iterations - best >= kPatience) {
      r.gave_up = true;
      break;
    }
  }
  triangulate();
  out.places_m = std::move(p_);
  out.triangles = std::move(triangles_);
  return out;
}

}  // namespace

PlanarTruss planar_truss(const DistanceFunction& f, const SizeFunction& size_m, double smallest_m,
                         const Eigen::AlignedBox3d& box_m, const std::vector<Vector3d>& fixed,
                         int most_iterations, std::uint64_t seed) {
  Truss truss(f, size_m, smallest_m);
  truss.scatter(box_m, fixed, seed);
  return std::move(truss).settle(most_iterations);
}

}  // namespace engine
