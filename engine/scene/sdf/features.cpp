#include "engine/scene/sdf/features.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr int kNewtonSteps = 20;
constexpr int kStepsToSize = 8;     ///< of a path, to an edge of the mesh
constexpr double kProbe = 1e-4;     ///< how far off a crease one looks, in edges of the mesh
constexpr double kTouching = 1e-6;  ///< squared sine of the angle at which two faces only touch
constexpr std::size_t kMostSteps = 20000;
constexpr double kMostLeaves = 2e6;

bool is_crease(unsigned sectors) noexcept {
  return std::popcount(sectors) == 1 || std::popcount(sectors) == 3;
}

/// Along creases of one solid.
class Tracer {
 public:
  Tracer(const Solid& solid, double size_m);
  [[nodiscard]] FeatureGraph trace() &&;

 private:
  using Pair = std::array<std::size_t, 2>;
  struct Frame {
    Vector3d along;                  ///< unit
    std::array<Vector3d, 2> across;  ///< changes one face's distance by 1 and not the other's
  };
  [[nodiscard]] std::optional<Frame> frame(const Pair& faces, const Vector3d& p) const;
  bool settle(const Pair& faces, double reach_m, Vector3d& p) const;
  [[nodiscard]] bool settle_corner(const std::array<std::size_t, 3>& faces, Vector3d& p) const;
  /// Which of the four sectors between two faces are inside, a bit each.
  [[nodiscard]] unsigned sectors(const Pair& faces, const Vector3d& p) const;
  void merge_faces();
  void look_into(const Eigen::AlignedBox3d& cell);
  void look_at_leaf(const Vector3d& centre, double reach_m);
  /// Whether a crease that is known passes here.
  [[nodiscard]] bool walked(const Pair& faces, const Vector3d& p) const;
  void follow(const Pair& faces, const Vector3d& seed);
  /// Creases so short that no seed found them.
  void follow_from_corner(std::size_t corner);
  /// Appends places; true when it came back to the first one.
  bool walk(const Pair& faces, double sign, std::vector<Vector3d>& path);
  std::optional<std::uint32_t> corner_after(const Pair& faces, const Vector3d& last,
                                            const Vector3d& beyond);
  void add_sides(FeatureGraph::Crease& crease);
  /// The sheet of a face where it looks one way.
  std::uint32_t sheet(std::size_t face, double sign);
  void miss(const std::string& what) {
    if (graph_.missing.empty()) graph_.missing = what;
  }

  const Solid& solid_;
  double size_m_;
  double step_m_;
  double leaf_m_;
  std::vector<std::size_t> first_;  ///< by face: the first one in the same surface
  std::vector<bool> seen_;          ///< by face: some of it is border
  std::map<std::pair<std::size_t, bool>, std::uint32_t> sheets_;
  FeatureGraph graph_;
};

Tracer::Tracer(const Solid& solid, double size_m)
    : solid_(solid), size_m_(size_m), step_m_(size_m / kStepsToSize), seen_(solid.faces(), false) {
  const Vector3d sizes = solid.bounds_m().sizes();
  leaf_m_ = std::max(size_m, sizes.maxCoeff() / 128.0);
  merge_faces();
}

void Tracer::merge_faces() {
  const Eigen::AlignedBox3d& box = solid_.bounds_m();
  const double same_m = 1e-9 * box.sizes().norm();
  for (std::size_t i = 0; i < solid_.faces(); ++i) {
    first_.push_back(i);
    for (std::size_t j = 0; j < i && first_[i] == i; ++j) {
      bool same = first_[j] == j;
      for (int k = 0; k < 8 && same; ++k) {
        const Vector3d share(0.137 + 0.1 * k, 0.91 - 0.11 * k, 0.05 + 0.37 * (k % 3));
        const Vector3d p = box.min() + box.sizes().cwiseProduct(share);
        same = std::abs(std::abs(solid_.face_distance_m(i, p)) -
                        std::abs(solid_.face_distance_m(j, p))) < same_m;
      }
      if (same) first_[i] = j;
    }
  }
}

std::optional<Tracer::Frame> Tracer::frame(const Pair& faces, const Vector3d& p) const {
  const Vector3d a = solid_.face_normal(faces[0], p);
  const Vector3d b = solid_.face_normal(faces[1], p);
  const Vector3d along = a.cross(b);
  const double sine2 = along.squaredNorm();
  if (!(sine2 > kTouching)) return std::nullopt;
  const double cosine = a.dot(b);
  return Frame{along / std::sqrt(sine2), {(a - cosine * b) / sine2, (b - cosine * a) / sine2}};
}

bool Tracer::settle(const Pair& faces, double reach_m, Vector3d& p) const {
  Vector3d q = p;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double a = solid_.face_distance_m(faces[0], q);
    const double b = solid_.face_distance_m(faces[1], q);
    const auto f = frame(faces, q);
    if (!f) return false;
    const Vector3d move = -a * f->across[0] - b * f->across[1];
    q += move;
    if (!((q - p).norm() <= reach_m)) return false;
    if (move.norm() <= 1e-14 * reach_m || (std::abs(a) + std::abs(b) <= 1e-13 * reach_m)) {
      p = q;
      return true;
    }
  }
  p = q;  // as near as rounding lets it
  return true;
}

bool Tracer::settle_corner(const std::array<std::size_t, 3>& faces, Vector3d& p) const {
  Vector3d q = p;
  for (int i = 0; i < kNewtonSteps; ++i) {
    Eigen::Matrix3d slopes;
    Vector3d values;
    for (int k = 0; k < 3; ++k) {
      const std::size_t face = faces[static_cast<std::size_t>(k)];
      slopes.row(k) = solid_.face_normal(face, q).transpose();
      values[k] = solid_.face_distance_m(face, q);
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(slopes);
    if (!(std::abs(slopes.determinant()) > 1e-6)) return false;
    const Vector3d move = solver.solve(-values);
    q += move;
    if (!((q - p).norm() <= 2.0 * step_m_)) return false;
    if (move.norm() <= 1e-15 * (1.0 + q.norm())) break;
  }
  p = q;
  return true;
}

unsigned Tracer::sectors(const Pair& faces, const Vector3d& p) const {
  const auto f = frame(faces, p);
  if (!f) return 0;
  unsigned inside = 0;
  for (unsigned i = 0; i < 4; ++i) {
    const Vector3d off =
        ((i & 1U) != 0 ? 1.0 : -1.0) * f->across[0] + ((i & 2U) != 0 ? 1.0 : -1.0) * f->across[1];
    if (solid_.holds(p + kProbe * size_m_ / off.norm() * off)) inside |= 1U << i;
  }
  return inside;
}

void Tracer::look_into(const Eigen::AlignedBox3d& cell) {
  const double half_m = 0.5 * cell.sizes().norm();
  if (std::abs(solid_.distance_m(cell.center())) > half_m) return;
  if (cell.sizes().maxCoeff() <= leaf_m_) return look_at_leaf(cell.center(), half_m);
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner =
        cell.min() + Vector3d(i & 1, (i >> 1) & 1, i >> 2).cwiseProduct(0.5 * cell.sizes());
    look_into({corner, corner + 0.5 * cell.sizes()});
  }
}

void Tracer::look_at_leaf(const Vector3d& centre, double reach_m) {
  std::vector<std::size_t> near;
  for (std::size_t i = 0; i < solid_.faces(); ++i) {
    if (first_[i] != i) continue;
    const double d = solid_.face_distance_m(i, centre);
    if (std::abs(d) > reach_m) continue;
    near.push_back(i);
    const Vector3d n = solid_.face_normal(i, centre);
    const Vector3d p = centre - d * n;
    const double off_m = kProbe * size_m_;
    if (solid_.holds(p + off_m * n) != solid_.holds(p - off_m * n)) seen_[i] = true;
  }
  for (const std::size_t i : near) {
    for (const std::size_t j : near) {
      if (j <= i) continue;
      Vector3d p = centre;
      if (settle({i, j}, reach_m, p) && is_crease(sectors({i, j}, p)) && !walked({i, j}, p))
        follow({i, j}, p);
    }
  }
}

bool Tracer::walk(const Pair& faces, double sign, std::vector<Vector3d>& path) {
  const Vector3d start = path.front();
  Vector3d p = path.back();
  Vector3d heading = sign * frame(faces, p)->along;
  const unsigned inside = sectors(faces, p);
  for (std::size_t i = 0; i < kMostSteps; ++i) {
    Vector3d next = p;
    std::optional<Frame> f;
    double step = step_m_;
    for (int tries = 0; tries < 6; ++tries, step *= 0.5) {
      next = p + step * heading;
      f.reset();
      if (!settle(faces, 0.5 * step, next)) continue;
      f = frame(faces, next);
      // A turn of more than 25 degrees in a step: too long a step.
      if (f && sign * f->along.dot(heading) > 0.9) break;
      f.reset();
    }
    if (!f) {
      miss("two of its faces touch without crossing");
      return false;
    }
    if (sectors(faces, next) != inside) {
      if (const auto corner = corner_after(faces, p, next))
        path.push_back(graph_.corners_m[*corner]);
      return false;
    }
    if (i > 2 && (next - start).norm() < 0.75 * step) return true;
    path.push_back(next);
    heading = sign * f->along;
    p = next;
  }
  miss("an edge has no end");
  return false;
}

std::optional<std::uint32_t> Tracer::corner_after(const Pair& faces, const Vector3d& last,
                                                  const Vector3d& beyond) {
  std::optional<Vector3d> nearest;
  for (std::size_t k = 0; k < solid_.faces(); ++k) {
    if (first_[k] != k || k == faces[0] || k == faces[1]) continue;
    const double a = solid_.face_distance_m(k, last);
    const double b = solid_.face_distance_m(k, beyond);
    if (a * b > 0.0 && std::min(std::abs(a), std::abs(b)) > 0.1 * step_m_) continue;
    Vector3d p = last + std::clamp(a / (a - b == 0.0 ? 1.0 : a - b), 0.0, 1.0) * (beyond - last);
    if (!settle_corner({faces[0], faces[1], k}, p)) continue;
    if (std::abs(solid_.distance_m(p)) > 1e-9 * size_m_) continue;
    const double ahead_m = (p - last).dot((beyond - last).normalized());
    if (ahead_m < -2.0 * kProbe * size_m_) continue;  // where the walk has come from
    if (ahead_m > 1.01 * (beyond - last).norm() + kProbe * size_m_) continue;
    if (!nearest || (p - last).norm() < (*nearest - last).norm()) nearest = p;
  }
  if (!nearest) {
    miss("an edge ends where no third face comes in");
    return std::nullopt;
  }
  for (std::uint32_t i = 0; i < graph_.corners_m.size(); ++i)
    if ((graph_.corners_m[i] - *nearest).norm() < 1e-6 * size_m_) return i;
  graph_.corners_m.push_back(*nearest);
  return static_cast<std::uint32_t>(graph_.corners_m.size() - 1);
}

bool Tracer::walked(const Pair& faces, const Vector3d& p) const {
  for (const FeatureGraph::Crease& crease : graph_.creases) {
    if (crease.faces[0] != faces[0] || crease.faces[1] != faces[1]) continue;
    for (const Vector3d& q : crease.path_m)
      if ((p - q).squaredNorm() < step_m_ * step_m_) return true;
  }
  return false;
}

void Tracer::follow_from_corner(std::size_t corner) {
  const Vector3d start = graph_.corners_m[corner];
  std::vector<std::size_t> here;
  for (std::size_t i = 0; i < solid_.faces(); ++i)
    if (first_[i] == i && std::abs(solid_.face_distance_m(i, start)) < 1e-9 * size_m_)
      here.push_back(i);
  for (const std::size_t i : here) {
    for (const std::size_t j : here) {
      const auto f = j > i ? frame({i, j}, start) : std::nullopt;
      if (!f) continue;
      for (const double sign : {-1.0, 1.0}) {
        const Vector3d heading = sign * f->along;
        Vector3d p = start + 0.02 * step_m_ * heading;
        if (!settle({i, j}, step_m_, p) || !is_crease(sectors({i, j}, p))) continue;
        const bool known = std::any_of(
            graph_.creases.begin(), graph_.creases.end(), [&](const FeatureGraph::Crease& c) {
              const auto leaves = [&](const Vector3d& end, const Vector3d& next) {
                return (end - start).norm() < 1e-6 * size_m_ && (next - end).dot(heading) > 0.0;
              };
              return !c.closed && c.faces[0] == i && c.faces[1] == j &&
                     (leaves(c.path_m.front(), c.path_m[1]) ||
                      leaves(c.path_m.back(), c.path_m[c.path_m.size() - 2]));
            });
        if (!known) follow({i, j}, p);
      }
    }
  }
}

void Tracer::follow(const Pair& faces, const Vector3d& seed) {
  FeatureGraph::Crease crease;
  crease.faces = {faces[0], faces[1]};
  crease.path_m = {seed};
  crease.closed = walk(faces, 1.0, crease.path_m);
  if (!crease.closed) {
    std::reverse(crease.path_m.begin(), crease.path_m.end());
    std::vector<Vector3d> back = {seed};
    if (walk(faces, -1.0, back)) miss("an edge closes one way only");
    crease.path_m.insert(crease.path_m.end(), back.begin() + 1, back.end());
  }
  if (!graph_.missing.empty()) return;
  if (!crease.closed) {
    const auto corner_at = [&](const Vector3d& p) {
      const auto it = std::find(graph_.corners_m.begin(), graph_.corners_m.end(), p);
      return static_cast<std::uint32_t>(it - graph_.corners_m.begin());
    };
    crease.corner = {corner_at(crease.path_m.front()), corner_at(crease.path_m.back())};
  }
  add_sides(crease);
  graph_.creases.push_back(std::move(crease));
}

std::uint32_t Tracer::sheet(std::size_t face, double sign) {
  const auto next = static_cast<std::uint32_t>(graph_.sheets.size());
  const auto [it, fresh] = sheets_.try_emplace({face, sign > 0.0}, next);
  if (fresh) {
    const Solid* solid = &solid_;
    graph_.sheets.push_back(
        {[=](const Vector3d& p) { return sign * solid->face_distance_m(face, p); },
         [=](const Vector3d& p) -> Vector3d { return sign * solid->face_normal(face, p); }});
  }
  return it->second;
}

/// On each face one of the two ways off the crease stays on the border.
void Tracer::add_sides(FeatureGraph::Crease& crease) {
  // An open one has its seed between its corners; a closed one has no end.
  const std::size_t at = crease.path_m.size() / 2;
  const Vector3d q = crease.path_m[at];
  const Vector3d heading = crease.path_m[(at + 1) % crease.path_m.size()] - q;
  const Pair faces = {crease.faces[0], crease.faces[1]};
  const double off_m = kProbe * size_m_;
  for (const std::size_t face : faces) {
    const Vector3d n = solid_.face_normal(face, q);
    for (const double side : {-1.0, 1.0}) {
      const Vector3d left = n.cross(heading).normalized();
      Vector3d off = q + side * off_m * left;
      off -= solid_.face_distance_m(face, off) * solid_.face_normal(face, off);
      const bool above = solid_.holds(off + 0.1 * off_m * n);
      const bool below = solid_.holds(off - 0.1 * off_m * n);
      if (above == below) continue;
      // A sheet that looks the other way has its left on the other side.
      const double sign = below ? 1.0 : -1.0;
      crease.sides.push_back({sheet(face, sign), side * sign > 0.0});
    }
  }
  if (crease.sides.size() != 2) miss("more than two faces meet in an edge");
}

FeatureGraph Tracer::trace() && {
  Eigen::AlignedBox3d box = solid_.bounds_m();
  const double side = box.sizes().maxCoeff() * 1.0173;
  const Vector3d middle = box.center() + Vector3d(0.0031, 0.0057, 0.0043) * side;
  const Vector3d half = Vector3d::Constant(0.5 * side * 1.02);
  const double area = std::pow(side / leaf_m_, 2);
  if (area > kMostLeaves) {
    miss("it is too large for edges so short");
    return std::move(graph_);
  }
  look_into({middle - half, middle + half});
  for (std::size_t i = 0; i < graph_.corners_m.size() && graph_.missing.empty(); ++i)
    follow_from_corner(i);
  if (!graph_.missing.empty()) return std::move(graph_);
  for (const Solid::Tip& tip : solid_.tips()) {
    if (std::abs(solid_.distance_m(tip.place_m)) > 1e-9 * size_m_) continue;
    for (const bool outwards : {true, false}) {
      const auto it = sheets_.find({first_[tip.face], outwards});
      if (it != sheets_.end()) graph_.tips.push_back({tip.place_m, it->second});
    }
  }
  for (std::size_t i = 0; i < solid_.faces(); ++i) {
    if (!seen_[i] || sheets_.contains({i, true}) || sheets_.contains({i, false})) continue;
    // Which way it looks, from any place on it: a little further out is outside.
    graph_.seamless.push_back(sheet(i, 1.0));
  }
  return std::move(graph_);
}

}  // namespace

FeatureGraph features_of(const Solid& solid, double size_m) {
  return Tracer(solid, size_m).trace();
}

}  // namespace engine
