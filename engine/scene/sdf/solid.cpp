#include "engine/scene/sdf/solid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/contract.h"

namespace engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kNewtonSteps = 20;
/// Operands that wait for their operation: of a tree so deep that nobody writes it.
constexpr std::size_t kDeepest = 256;

double box_distance_m(const Vector3d& half_m, const Vector3d& p) noexcept {
  const Vector3d over = p.cwiseAbs() - half_m;
  return over.cwiseMax(0.0).norm() + std::min(over.maxCoeff(), 0.0);
}

/// Size: radius at -x, radius at +x, half the length.
double cone_distance_m(const Vector3d& size, const Vector3d& p) noexcept {
  const double half = size.z();
  const Vector2d q(std::hypot(p.y(), p.z()), p.x());
  const Vector2d k1(size.y(), half);
  const Vector2d k2(size.y() - size.x(), 2.0 * half);
  const double rim = q.y() < 0.0 ? size.x() : size.y();
  const Vector2d to_cap(q.x() - std::min(q.x(), rim), std::abs(q.y()) - half);
  const double along = std::clamp((k1 - q).dot(k2) / k2.squaredNorm(), 0.0, 1.0);
  const Vector2d to_side = q - k1 + k2 * along;
  const double sign = to_side.x() < 0.0 && to_cap.y() < 0.0 ? -1.0 : 1.0;
  return sign * std::sqrt(std::min(to_cap.squaredNorm(), to_side.squaredNorm()));
}

double torus_distance_m(const Vector3d& size, const Vector3d& p) noexcept {
  return std::hypot(std::hypot(p.y(), p.z()) - size.x(), p.x()) - size.y();
}

/// Of the cone without ends: positive outside, measured square to its side.
double cone_side_m(const Vector3d& size, const Vector3d& p) noexcept {
  const double rise = size.y() - size.x();
  const double run = 2.0 * size.z();
  const double at = 0.5 * (size.x() + size.y()) + rise / run * p.x();
  return (std::hypot(p.y(), p.z()) - at) * run / std::hypot(rise, run);
}

Vector3d radial(const Vector3d& p) noexcept {
  const Vector3d out(0.0, p.y(), p.z());
  const double r = out.norm();
  return r > 0.0 ? Vector3d(out / r) : Vector3d::Zero();
}

}  // namespace

Vector3d slope(const DistanceFunction& f, const Vector3d& p, double step_m) {
  Vector3d g;
  for (int i = 0; i < 3; ++i) {
    const Vector3d d = step_m * Vector3d::Unit(i);
    g[i] = (f(p + d) - f(p - d)) / (2.0 * step_m);
  }
  return g;
}

bool pull_to_zero(const DistanceFunction& f, double reach_m, double good_m, Vector3d& p_m) {
  Vector3d p = p_m;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double value = f(p);
    if (std::abs(value) <= good_m) {
      p_m = p;
      return true;
    }
    const Vector3d g = slope(f, p, 1e-4 * reach_m);
    const double g2 = g.squaredNorm();
    if (!(g2 > 1e-6) || !std::isfinite(g2)) return false;
    p -= value / g2 * g;
    if (!((p - p_m).norm() <= reach_m)) return false;
  }
  return false;
}

void Solid::add_plane(const Vector3d& normal, double offset_m) {
  Face face;
  face.size_m = normal;
  face.to_own.translation() = -offset_m * normal;
  faces_.push_back(face);
}

Solid Solid::box(const Vector3d& size_m) {
  Solid s;
  s.nodes_.push_back({Kind::kBox, 0.5 * size_m, Eigen::Isometry3d::Identity()});
  for (int i = 0; i < 3; ++i) {
    s.add_plane(Vector3d::Unit(i), 0.5 * size_m[i]);
    s.add_plane(-Vector3d::Unit(i), 0.5 * size_m[i]);
  }
  s.bounds_m_ = {-0.5 * size_m, 0.5 * size_m};
  return s;
}

Solid Solid::sphere(double radius_m) {
  Solid s;
  const Vector3d size(radius_m, radius_m, radius_m);
  s.nodes_.push_back({Kind::kSphere, size, Eigen::Isometry3d::Identity()});
  s.faces_.push_back({Surface::kSphere, size, Eigen::Isometry3d::Identity(), 1.0});
  s.bounds_m_ = {-size, size};
  return s;
}

Solid Solid::torus(double ring_radius_m, double tube_radius_m) {
  Solid s;
  const Vector3d size(ring_radius_m, tube_radius_m, 0.0);
  s.nodes_.push_back({Kind::kTorus, size, Eigen::Isometry3d::Identity()});
  s.faces_.push_back({Surface::kTorus, size, Eigen::Isometry3d::Identity(), 1.0});
  const double reach = ring_radius_m + tube_radius_m;
  s.bounds_m_ = {Vector3d(-tube_radius_m, -reach, -reach), Vector3d(tube_radius_m, reach, reach)};
  return s;
}

Solid Solid::cylinder(double radius_m, double length_m) {
  return cone(radius_m, radius_m, length_m);
}

Solid Solid::cone(double from_radius_m, double to_radius_m, double length_m) {
  Solid s;
  const Vector3d size(from_radius_m, to_radius_m, 0.5 * length_m);
  s.nodes_.push_back({Kind::kCone, size, Eigen::Isometry3d::Identity()});
  s.faces_.push_back({Surface::kCone, size, Eigen::Isometry3d::Identity(), 1.0});
  if (from_radius_m > 0.0) s.add_plane(-Vector3d::UnitX(), 0.5 * length_m);
  if (to_radius_m > 0.0) s.add_plane(Vector3d::UnitX(), 0.5 * length_m);
  const double r = std::max(from_radius_m, to_radius_m);
  s.bounds_m_ = {Vector3d(-0.5 * length_m, -r, -r), Vector3d(0.5 * length_m, r, r)};
  return s;
}

Solid Solid::moved(const Eigen::Isometry3d& pose) const {
  Solid s = *this;
  const Eigen::Isometry3d back = pose.inverse();
  for (Node& node : s.nodes_) node.to_own = node.to_own * back;
  for (Face& face : s.faces_) face.to_own = face.to_own * back;
  s.bounds_m_ = bounds_m_.transformed(pose);
  return s;
}

Solid Solid::joined(const Solid& other, Kind how) const {
  Solid s = *this;
  s.nodes_.insert(s.nodes_.end(), other.nodes_.begin(), other.nodes_.end());
  s.nodes_.push_back({how, Vector3d::Zero(), Eigen::Isometry3d::Identity()});
  for (Face face : other.faces_) {
    if (how == Kind::kCut) face.sign = -face.sign;
    s.faces_.push_back(face);
  }
  return s;
}

Solid Solid::united(const Solid& other) const {
  Solid s = joined(other, Kind::kUnion);
  s.bounds_m_.extend(other.bounds_m_);
  return s;
}

Solid Solid::cut_by(const Solid& other) const { return joined(other, Kind::kCut); }

Solid Solid::shared(const Solid& other) const {
  Solid s = joined(other, Kind::kShared);
  s.bounds_m_.clamp(other.bounds_m_);
  return s;
}

double Solid::own_distance_m(const Node& node, const Vector3d& p_m) noexcept {
  const Vector3d p = node.to_own * p_m;
  switch (node.kind) {
    case Kind::kBox:
      return box_distance_m(node.size_m, p);
    case Kind::kSphere:
      return p.norm() - node.size_m.x();
    case Kind::kTorus:
      return torus_distance_m(node.size_m, p);
    default:
      return cone_distance_m(node.size_m, p);
  }
}

double Solid::distance_m(const Vector3d& p_m) const noexcept {
  std::array<double, kDeepest> waiting{};
  std::size_t n = 0;
  for (const Node& node : nodes_) {
    if (node.kind < Kind::kUnion) {
      ENSURE(n < kDeepest);
      waiting[n++] = own_distance_m(node, p_m);
      continue;
    }
    const double b = waiting[--n];
    double& a = waiting[n - 1];
    a = node.kind == Kind::kUnion ? std::min(a, b) : std::max(a, node.kind == Kind::kCut ? -b : b);
  }
  return waiting[0];
}

double Solid::face_distance_m(std::size_t face, const Vector3d& p_m) const noexcept {
  const Face& f = faces_[face];
  const Vector3d p = f.to_own * p_m;
  switch (f.surface) {
    case Surface::kPlane:
      return f.sign * f.size_m.dot(p);
    case Surface::kSphere:
      return f.sign * (p.norm() - f.size_m.x());
    case Surface::kTorus:
      return f.sign * torus_distance_m(f.size_m, p);
    case Surface::kCone:
      return f.sign * cone_side_m(f.size_m, p);
  }
  return 0.0;
}

Vector3d Solid::face_normal(std::size_t face, const Vector3d& p_m) const noexcept {
  const Face& f = faces_[face];
  const Vector3d p = f.to_own * p_m;
  Vector3d n = f.size_m;
  if (f.surface == Surface::kSphere) {
    n = p;
  } else if (f.surface == Surface::kTorus) {
    n = p - f.size_m.x() * radial(p);
  } else if (f.surface == Surface::kCone) {
    n = radial(p) * (2.0 * f.size_m.z());
    if (!n.isZero(0.0)) n.x() = f.size_m.x() - f.size_m.y();
  }
  const double length = n.norm();
  if (!(length > 0.0)) return Vector3d::Zero();
  return f.to_own.linear().transpose() * (f.sign / length * n);
}

std::vector<Solid::Tip> Solid::tips() const {
  std::vector<Tip> tips;
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Face& f = faces_[i];
    if (f.surface != Surface::kCone) continue;
    const Eigen::Isometry3d pose = f.to_own.inverse();
    if (f.size_m.x() == 0.0) tips.push_back({pose * Vector3d(-f.size_m.z(), 0, 0), i});
    if (f.size_m.y() == 0.0) tips.push_back({pose * Vector3d(f.size_m.z(), 0, 0), i});
  }
  return tips;
}

}  // namespace engine
