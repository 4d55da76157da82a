#include "engine/scene/sdf/marching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kMostPlaces = 4e6;
constexpr int kBisections = 40;
constexpr int kRefinements = 2;
/// What lies across the surface by less than this share of a cell is but its curvature.
constexpr double kDeep = 0.1;

/// The six tetrahedra of a cell, by its corners (bit 0: +x, bit 1: +y, bit 2: +z), all round the
/// diagonal from 0 to 7 and with the same handedness (Kuhn 1960).
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

/// Where the function changes its sign between two places.
Vector3d crossing(const DistanceFunction& f, Vector3d inside, Vector3d outside) {
  for (int i = 0; i < kBisections; ++i) {
    const Vector3d middle = 0.5 * (inside + outside);
    (f(middle) < 0.0 ? inside : outside) = middle;
  }
  return 0.5 * (inside + outside);
}

class Lattice {
 public:
  Lattice(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m, double step_m);
  [[nodiscard]] MarchedSurface surface();
  [[nodiscard]] const MarchReport& report() const noexcept { return report_; }

 private:
  using Cell = Eigen::Vector3i;
  [[nodiscard]] std::size_t index(const Cell& c) const noexcept {
    return (static_cast<std::size_t>(c.z()) * static_cast<std::size_t>(count_.y()) +
            static_cast<std::size_t>(c.y())) *
               static_cast<std::size_t>(count_.x()) +
           static_cast<std::size_t>(c.x());
  }
  [[nodiscard]] Vector3d place(const Cell& c) const noexcept {
    return low_m_ + report_.step_m * c.cast<double>();
  }
  void look_between(const Cell& c);
  std::uint32_t cut(const Cell& a, const Cell& b);
  void add_tetrahedron(const Cell& cell, const std::array<int, 4>& corners);

  const DistanceFunction& f_;
  Vector3d low_m_;
  Eigen::Vector3i count_;
  std::vector<float> value_;
  std::unordered_map<std::uint64_t, std::uint32_t> cuts_;
  MarchedSurface out_;
  MarchReport report_;
};

Lattice::Lattice(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m, double step_m)
    : f_(f) {
  const Vector3d sizes = box_m.sizes();
  report_.step_m = std::max(step_m, std::cbrt(sizes.prod() / kMostPlaces));
  // A flat box has its places on few planes.
  report_.step_m = std::max(report_.step_m, sizes.maxCoeff() / 1000.0);
  for (int i = 0; i < 3; ++i) count_[i] = static_cast<int>(sizes[i] / report_.step_m) + 4;
  // Off the box's middle by an odd share: what is symmetric has no places on its planes.
  low_m_ = box_m.center() - report_.step_m * (0.5 * (count_.cast<double>().array() - 1.0) +
                                              Eigen::Array3d(0.0137, 0.0231, 0.0179))
                                                 .matrix();
  value_.resize(static_cast<std::size_t>(count_.x()) * static_cast<std::size_t>(count_.y()) *
                static_cast<std::size_t>(count_.z()));
  Cell c;
  for (c.z() = 0; c.z() < count_.z(); ++c.z()) {
    for (c.y() = 0; c.y() < count_.y(); ++c.y()) {
      for (c.x() = 0; c.x() < count_.x(); ++c.x()) {
        double v = f(place(c));
        if (!std::isfinite(v)) {
          ++report_.not_finite;
          v = report_.step_m;
        }
        const bool side = (c.array() == 0).any() || (c.array() == count_.array() - 1).any();
        if (side && v < 0.0) ++report_.inside_at_sides;
        value_[index(c)] = side ? std::max(static_cast<float>(v), 1e-30F) : static_cast<float>(v);
      }
    }
  }
  for (c.z() = 1; c.z() + 1 < count_.z(); ++c.z())
    for (c.y() = 1; c.y() + 1 < count_.y(); ++c.y())
      for (c.x() = 1; c.x() + 1 < count_.x(); ++c.x()) look_between(c);
}

/// A function with a slope of at most 1 is furthest from both ends where the two bounds meet.
void Lattice::look_between(const Cell& c) {
  for (int i = 0; i < 3; ++i) {
    const Cell d = c + Cell::Unit(i);
    const double a = value_[index(c)];
    const double b = value_[index(d)];
    if ((a < 0.0) != (b < 0.0) || std::abs(a) + std::abs(b) >= report_.step_m) continue;
    const double share = 0.5 + 0.5 * (std::abs(a) - std::abs(b)) / report_.step_m;
    const double v = f_(place(c) + share * (place(d) - place(c)));
    if ((v < 0.0) != (a < 0.0) && std::abs(v) > kDeep * report_.step_m) ++report_.unresolved;
  }
}

std::uint32_t Lattice::cut(const Cell& a, const Cell& b) {
  const std::uint64_t i = index(a);
  const std::uint64_t j = index(b);
  const std::uint64_t key = (std::min(i, j) << 32) | std::max(i, j);
  const auto [it, fresh] = cuts_.emplace(key, static_cast<std::uint32_t>(out_.places_m.size()));
  if (fresh) {
    const bool a_inside = value_[i] < 0.0F;
    out_.places_m.push_back(crossing(f_, place(a_inside ? a : b), place(a_inside ? b : a)));
  }
  return it->second;
}

void Lattice::add_tetrahedron(const Cell& cell, const std::array<int, 4>& corners) {
  std::vector<Cell> in;
  std::vector<Cell> out;
  for (const int c : corners) {
    const Cell at = cell + Cell(c & 1, (c >> 1) & 1, c >> 2);
    (value_[index(at)] < 0.0F ? in : out).push_back(at);
  }
  if (in.empty() || out.empty()) return;
  // The edges that are cut, in turn round the cut.
  std::vector<std::pair<Cell, Cell>> ring;
  if (in.size() == 2) {
    ring = {{in[0], out[0]}, {in[0], out[1]}, {in[1], out[1]}, {in[1], out[0]}};
  } else {
    for (const Cell& a : in)
      for (const Cell& b : out) ring.emplace_back(a, b);
  }
  // Outwards by the lattice's places: the cuts may lie so near each other that they span nothing.
  const auto middle = [](const std::pair<Cell, Cell>& e) -> Vector3d {
    return 0.5 * (e.first + e.second).cast<double>();
  };
  const Vector3d across =
      (middle(ring[1]) - middle(ring[0])).cross(middle(ring[2]) - middle(ring[0]));
  const Vector3d outwards = (out[0] - in[0]).cast<double>();
  if (across.dot(outwards) < 0.0) std::reverse(ring.begin(), ring.end());
  std::vector<std::uint32_t> at;
  for (const auto& [a, b] : ring) at.push_back(cut(a, b));
  out_.triangles.push_back({at[0], at[1], at[2]});
  if (at.size() == 4) out_.triangles.push_back({at[0], at[2], at[3]});
}

MarchedSurface Lattice::surface() {
  Cell c;
  for (c.z() = 0; c.z() + 1 < count_.z(); ++c.z()) {
    for (c.y() = 0; c.y() + 1 < count_.y(); ++c.y()) {
      for (c.x() = 0; c.x() + 1 < count_.x(); ++c.x()) {
        const bool inside = value_[index(c)] < 0.0F;
        bool crossed = false;
        for (int i = 1; i < 8 && !crossed; ++i)
          crossed = (value_[index(c + Cell(i & 1, (i >> 1) & 1, i >> 2))] < 0.0F) != inside;
        if (!crossed) continue;
        for (const auto& tetrahedron : kTetrahedra) add_tetrahedron(c, tetrahedron);
      }
    }
  }
  out_.report = report_;
  return std::move(out_);
}

}  // namespace

MarchedSurface marched_surface(const DistanceFunction& f, const Eigen::AlignedBox3d& box_m,
                               double step_m) {
  for (int i = 0;; ++i) {
    Lattice lattice(f, box_m, step_m);
    if (lattice.report().unresolved == 0 || i == kRefinements) return lattice.surface();
    step_m *= 0.5;
  }
}

}  // namespace engine
