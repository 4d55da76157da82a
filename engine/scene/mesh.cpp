#include "engine/scene/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "engine/scene/vertex_places.h"

namespace engine {
namespace {

using Eigen::Vector3f;

struct Corner {
  Vector3f normal = Vector3f::Zero();  ///< of its triangle
  float angle = 0;
};

struct Crease {
  float angle_rad;
  float cosine;
};

void add_if_smooth(const Corner& corner, const Vector3f& normal, const Crease& crease,
                   Vector3f& sum) {
  if (const float cosine = corner.normal.dot(normal); std::abs(cosine) >= crease.cosine)
    sum += std::copysign(corner.angle, cosine) * corner.normal;  // a face may run backwards
}

/// The corners of one place, those together whose normals lie in one cell of the directions, either
/// way round: most cells lie within the crease of a normal, or beyond it, as a whole. So the tip of
/// a cone of n triangles takes some n^2 / 20 steps, not n^2.
class NormalCells {
 public:
  NormalCells(std::span<const std::uint32_t> meeting, const std::vector<Corner>& corners)
      : corners_(corners) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_cell;
    by_cell.reserve(meeting.size());
    for (const std::uint32_t i : meeting) by_cell.emplace_back(cell_of(corners[i].normal), i);
    std::ranges::sort(by_cell);
    for (const auto& [cell, i] : by_cell) order_.push_back(i);
    for (std::size_t first = 0; first < order_.size();) {
      std::size_t end = first + 1;
      while (end < order_.size() && by_cell[end].first == by_cell[first].first) ++end;
      add_cell(first, end);
      first = end;
    }
  }

  [[nodiscard]] Vector3f sum_about(const Vector3f& normal, const Crease& crease) const {
    constexpr float kRounding_rad = 2e-3F;  // of the arc cosines near 1
    const float same_side_rad = std::min(crease.angle_rad, static_cast<float>(M_PI_2));
    Vector3f sum = Vector3f::Zero();
    for (const Cell& cell : cells_) {
      const float cosine = cell.axis.dot(normal);
      const float off_rad = std::acos(std::min(std::abs(cosine), 1.0F));
      const float reach_rad = cell.radius_rad + kRounding_rad;
      if (off_rad - reach_rad > crease.angle_rad) continue;
      if (off_rad + reach_rad < same_side_rad) {
        sum += std::copysign(1.0F, cosine) * cell.sum;
      } else {
        for (std::size_t k = cell.first; k < cell.end; ++k)
          add_if_smooth(corners_[order_[k]], normal, crease, sum);
      }
    }
    return sum;
  }

 private:
  struct Cell {
    std::size_t first;
    std::size_t end;
    Vector3f axis;  ///< unit
    Vector3f sum;   ///< of what its corners add, on the axis's side
    float radius_rad;
  };

  /// On a cube of squares, of which opposite ones are one.
  [[nodiscard]] static std::uint32_t cell_of(const Vector3f& normal) {
    constexpr float kPerSide = 32;
    if (!(normal.squaredNorm() > 0.0F)) return std::numeric_limits<std::uint32_t>::max();
    Eigen::Index face = 0;
    normal.cwiseAbs().maxCoeff(&face);
    auto cell = static_cast<std::uint32_t>(face);
    for (Eigen::Index k = 1; k < 3; ++k) {
      const float at = normal[(face + k) % 3] / normal[face];
      const float step = std::clamp(std::floor(0.5F * (at + 1.0F) * kPerSide), 0.0F, kPerSide - 1);
      cell = cell * static_cast<std::uint32_t>(kPerSide) + static_cast<std::uint32_t>(step);
    }
    return cell;
  }

  void add_cell(std::size_t first, std::size_t end) {
    Cell cell{first, end, corners_[order_[first]].normal, Vector3f::Zero(), 0};
    float lowest = 1;
    for (std::size_t k = first; k < end; ++k) {
      const Corner& corner = corners_[order_[k]];
      const float cosine = corner.normal.dot(cell.axis);
      lowest = std::min(lowest, std::abs(cosine));
      cell.sum += std::copysign(corner.angle, cosine) * corner.normal;
    }
    cell.radius_rad = std::acos(lowest);
    cells_.push_back(cell);
  }

  const std::vector<Corner>& corners_;
  std::vector<std::uint32_t> order_;  ///< cell by cell
  std::vector<Cell> cells_;
};

}  // namespace

std::uint32_t Mesh::material(const std::string& name) {
  const auto it = std::find(material_names.begin(), material_names.end(), name);
  if (it != material_names.end()) return static_cast<std::uint32_t>(it - material_names.begin());
  material_names.push_back(name);
  return static_cast<std::uint32_t>(material_names.size() - 1);
}

double Mesh::bounding_radius_m() const noexcept {
  double r2 = 0;
  for (const auto& v : vertices) r2 = std::max(r2, v.cast<double>().squaredNorm());
  return std::sqrt(r2);
}

std::vector<CornerNormals> smooth_normals(const Mesh& mesh, double crease_rad) {
  const std::size_t count = 3 * mesh.triangles.size();
  // By place, not by index: parts of a mesh often have corners of their own.
  const std::vector<std::uint32_t> place = first_at_place(mesh.vertices, 0.0);
  std::vector<Corner> corners(count);
  std::vector<std::size_t> first(mesh.vertices.size() + 1, 0);
  const auto place_of = [&](std::size_t i) { return place[mesh.triangles[i / 3].corner[i % 3]]; };
  for (std::size_t i = 0; i < count; ++i) {
    const Mesh::Triangle& t = mesh.triangles[i / 3];
    const Vector3f& p = mesh.vertices[t.corner[i % 3]];
    const Vector3f e1 = mesh.vertices[t.corner[(i + 1) % 3]] - p;
    const Vector3f e2 = mesh.vertices[t.corner[(i + 2) % 3]] - p;
    const Vector3f across = e1.cross(e2);
    corners[i] = {across.normalized(), std::atan2(across.norm(), e1.dot(e2))};
    ++first[place_of(i) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  // Corners that meet, in the order of their triangles: sums come out the same every time.
  std::vector<std::uint32_t> meeting(count);
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
    meeting[next[place_of(i)]++] = static_cast<std::uint32_t>(i);

  const Crease crease{static_cast<float>(crease_rad), static_cast<float>(std::cos(crease_rad))};
  constexpr std::size_t kMany = 1024;
  std::vector<CornerNormals> normals(mesh.triangles.size());
  for (std::size_t p = 0; p < mesh.vertices.size(); ++p) {
    const std::span<const std::uint32_t> here =
        std::span(meeting).subspan(first[p], first[p + 1] - first[p]);
    const NormalCells cells(here.size() > kMany ? here : here.first(0), corners);
    for (const std::uint32_t i : here) {
      Vector3f sum = Vector3f::Zero();
      if (here.size() > kMany) {
        sum = cells.sum_about(corners[i].normal, crease);
      } else {
        for (const std::uint32_t k : here)
          add_if_smooth(corners[k], corners[i].normal, crease, sum);
      }
      normals[i / 3][i % 3] = sum.normalized();
    }
  }
  return normals;
}

}  // namespace engine
