#include "engine/scene/nearest_facet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace engine {
namespace {

using Eigen::Vector3f;

constexpr int kMostCells = 192;  ///< along an axis
// Of all triangles' cells: more than real meshes need.
constexpr std::size_t kMostEach = 64;
constexpr std::size_t kMostBesides = 4'000'000;

/// Ericson 2005, Real-Time Collision Detection, section 5.1.5.
std::array<float, 2> weights_nearest(const Vector3f& p, const Vector3f& a, const Vector3f& b,
                                     const Vector3f& c) noexcept {
  const Vector3f ab = b - a;
  const Vector3f ac = c - a;
  const float d1 = ab.dot(p - a);
  const float d2 = ac.dot(p - a);
  if (d1 <= 0.0F && d2 <= 0.0F) return {0.0F, 0.0F};
  const float d3 = ab.dot(p - b);
  const float d4 = ac.dot(p - b);
  if (d3 >= 0.0F && d4 <= d3) return {1.0F, 0.0F};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0F && d1 >= 0.0F && d3 <= 0.0F) return {d1 / (d1 - d3), 0.0F};
  const float d5 = ab.dot(p - c);
  const float d6 = ac.dot(p - c);
  if (d6 >= 0.0F && d5 <= d6) return {0.0F, 1.0F};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0F && d2 >= 0.0F && d6 <= 0.0F) return {0.0F, d2 / (d2 - d6)};
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0F && d4 - d3 >= 0.0F && d5 - d6 >= 0.0F) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1.0F - w, w};
  }
  const float scale = 1.0F / (va + vb + vc);
  return {vb * scale, vc * scale};
}

}  // namespace

NearestFacet::NearestFacet(const Mesh& mesh, double reach_m)
    : mesh_(mesh), reach_m_(static_cast<float>(reach_m)) {
  if (mesh.triangles.empty()) return;
  low_ = Vector3f::Constant(std::numeric_limits<float>::max());
  Vector3f high = -low_;
  for (const Mesh::Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t.corner) {
      low_ = low_.cwiseMin(mesh.vertices[corner]);
      high = high.cwiseMax(mesh.vertices[corner]);
    }
    const Vector3f& a = mesh.vertices[t.corner[0]];
    normals_.emplace_back(
        (mesh.vertices[t.corner[1]] - a).cross(mesh.vertices[t.corner[2]] - a).normalized());
  }
  cell_m_ = std::max(
      {reach_m_, (high - low_).maxCoeff() / kMostCells, std::numeric_limits<float>::min()});
  cells_ = cell_of(high) + Cell::Ones();
  const auto cells = static_cast<std::size_t>(cells_.x()) * static_cast<std::size_t>(cells_.y()) *
                     static_cast<std::size_t>(cells_.z());
  std::vector<std::uint32_t> starts(cells + 1, 0);
  std::size_t all = 0;
  const std::size_t most = kMostEach * mesh.triangles.size() + kMostBesides;
  for (const Mesh::Triangle& t : mesh.triangles) {
    if (all > most) return;
    each_cell_of(t, [&](std::size_t cell) {
      ++starts[cell + 1];
      ++all;
    });
  }
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  triangles_.resize(all);
  std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    each_cell_of(mesh.triangles[i], [&](std::size_t cell) { triangles_[next[cell]++] = i; });
  starts_ = std::move(starts);
}

/// Those of the triangle's box that its plane comes near.
template <class Visit>
void NearestFacet::each_cell_of(const Mesh::Triangle& triangle, const Visit& visit) const {
  const Vector3f& a = mesh_.vertices[triangle.corner[0]];
  const Vector3f& b = mesh_.vertices[triangle.corner[1]];
  const Vector3f& c = mesh_.vertices[triangle.corner[2]];
  const Cell from = cell_of(a.cwiseMin(b).cwiseMin(c));
  const Cell to = cell_of(a.cwiseMax(b).cwiseMax(c));
  const Vector3f normal = (b - a).cross(c - a).normalized();
  const float half_m = 0.51F * cell_m_ * normal.cwiseAbs().sum();
  for (int z = from.z(); z <= to.z(); ++z) {
    for (int y = from.y(); y <= to.y(); ++y) {
      for (int x = from.x(); x <= to.x(); ++x) {
        const Vector3f middle =
            low_ + cell_m_ * (Cell(x, y, z).cast<float>() + Vector3f::Constant(0.5F));
        if (!(std::abs(normal.dot(middle - a)) > half_m)) visit(index_of({x, y, z}));
      }
    }
  }
}

NearestFacet::Cell NearestFacet::cell_of(const Vector3f& point) const noexcept {
  const Vector3f place = ((point - low_) / cell_m_).cwiseMax(-2.0F).cwiseMin(2.0F + kMostCells);
  return place.array().floor().cast<int>();
}

std::size_t NearestFacet::index_of(const Cell& cell) const noexcept {
  return static_cast<std::size_t>((cell.z() * cells_.y() + cell.y()) * cells_.x() + cell.x());
}

float NearestFacet::squared_distance_to(const Cell& cell, const Vector3f& point) const noexcept {
  const Vector3f low = low_ + cell_m_ * cell.cast<float>();
  const Vector3f beside =
      (low - point).cwiseMax(point - low - Vector3f::Constant(cell_m_)).cwiseMax(0.0F);
  return beside.squaredNorm();
}

NearestFacet::Place NearestFacet::find(const Vector3f& point, const Vector3f& normal,
                                       std::uint32_t material) const noexcept {
  // By how they face: as the normal does, or against it.
  std::array<Place, 2> nearest;
  std::array<float, 2> squared_m2{reach_m_ * reach_m_, reach_m_ * reach_m_};
  const auto visit = [&](const Cell& cell) {
    const std::size_t index = index_of(cell);
    for (std::uint32_t k = starts_[index]; k < starts_[index + 1]; ++k) {
      const std::uint32_t i = triangles_[k];
      const Mesh::Triangle& t = mesh_.triangles[i];
      if (t.material != material) continue;
      const std::size_t against = normals_[i].dot(normal) > 0.0F ? 0 : 1;
      const Vector3f& a = mesh_.vertices[t.corner[0]];
      const Vector3f& b = mesh_.vertices[t.corner[1]];
      const Vector3f& c = mesh_.vertices[t.corner[2]];
      const auto [second, third] = weights_nearest(point, a, b, c);
      const float d2 = (a + second * (b - a) + third * (c - a) - point).squaredNorm();
      if (!(d2 < squared_m2[against])) continue;
      squared_m2[against] = d2;
      nearest[against] = {i, second, third, std::sqrt(d2)};
    }
  };
  if (!fits()) return {};
  const Cell own = cell_of(point);
  const auto is_cell = [&](const Cell& cell) {
    return (cell.array() >= 0).all() && (cell.array() < cells_.array()).all();
  };
  if (is_cell(own)) visit(own);
  for (int i = 0; i < 27; ++i) {
    const Cell cell = own + Cell(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (i != 13 && is_cell(cell) && squared_distance_to(cell, point) < squared_m2[0]) visit(cell);
  }
  return nearest[0].triangle != kNone ? nearest[0] : nearest[1];
}

}  // namespace engine
