#include "engine/render/lamp_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/render/facets.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kBandRows = 16;
constexpr double kDirectionsARadian = 1000.0;
// What stands above a plane by less is taken to lie on it: corners are whole sixteenths of a step
// on the map, so a plane is off by that on its slope, and rounding adds some.
constexpr float kAbove_steps = 0.05F;
constexpr float kAcross_steps = 0.0625F;
// The rest of a hollow stands above the plane of a facet at its bottom that is smaller than a step.
// What casts a shadow there stands higher.
constexpr float kShades_steps = 3.0F;
constexpr int kMostSteps = 24;

// By column of the map.
constexpr unsigned kColumns = 1024;
constexpr std::array<float, kColumns> kYInStep = [] {
  std::array<float, kColumns> y{};
  for (std::size_t i = 0; i < y.size(); ++i)
    y[i] = static_cast<float>(TriangleRaster::kPlaceInStep[i % TriangleRaster::kPeriod]) /
           TriangleRaster::kStep;
  return y;
}();

}  // namespace

LampView::LampView(const Mesh& mesh)
    : mesh_(mesh),
      radius_m_(mesh.bounding_radius_m()),
      raster_(mesh.vertices.size(), mesh.triangles.size(), kSide / kBandRows),
      corners_(mesh.vertices.size()),
      facets_(std::size_t{kSide} * kSide),
      nearness_(facets_.size()),
      planes_(mesh.triangles.size()) {}

void LampView::update(const Vector3d& toward, WorkerPool& pool) noexcept {
  const Vector3d rounded = (toward * kDirectionsARadian).array().round().matrix().normalized();
  if (rounded == toward_) return;
  toward_ = rounded;
  const Matrix3d axes = basis_round(rounded);
  const double steps_a_m = 0.5 * kSide / radius_m_;
  to_map_ = (steps_a_m * axes.topRows<2>()).cast<float>();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Vector3d p = axes * mesh_.vertices[i].cast<double>();
    corners_[i] = {0.5 * kSide + steps_a_m * p.x(), 0.5 * kSide + steps_a_m * p.y(), p.z()};
  }
  // A direction that is no number does not fit: everything is asked for by rays.
  const int side = kSide;
  const bool fits = raster_.place(mesh_, corners_, side, side, kBandRows);
  if (fits) pool.rows(0, raster_.bands(), [this](int band) { draw(band); });
  constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
  for (std::uint32_t f = 0; f < planes_.size(); ++f)
    planes_[f] = fits ? plane_of(f, axes) : Plane{kNoNumber, 0.0F, 0.0F};
}

LampView::Plane LampView::plane_of(std::uint32_t facet, const Matrix3d& axes) const noexcept {
  const auto& corner = mesh_.triangles[facet].corner;
  const Vector3d a = axes * mesh_.vertices[corner[0]].cast<double>();
  const Vector3d b = axes * mesh_.vertices[corner[1]].cast<double>() - a;
  const Vector3d c = axes * mesh_.vertices[corner[2]].cast<double>() - a;
  const Vector3d normal = b.cross(c);
  // Edge-on it is infinite or no number: neither above nor below anything.
  const double per_x = -normal.x() / normal.z();
  const double per_y = -normal.y() / normal.z();
  const double m_a_step = 2.0 * radius_m_ / kSide;
  return {static_cast<float>(a.z() - per_x * (a.x() + radius_m_) - per_y * (a.y() + radius_m_)),
          static_cast<float>(per_x * m_a_step), static_cast<float>(per_y * m_a_step)};
}

void LampView::draw(int band) noexcept {
  const std::size_t size = std::size_t{kSide} * kBandRows;
  const std::size_t first = static_cast<std::size_t>(band) * size;
  raster_.see(band, std::span(facets_).subspan(first, size),
              std::span(nearness_).subspan(first, size));
}

LampView::Steps LampView::count(std::uint32_t facet, const Eigen::Vector2f& low,
                                const Eigen::Vector2f& high, int beyond,
                                bool mixed_ends) const noexcept {
  static_assert(kColumns == kSide);
  // With all points round the rectangle; not off the map, nor a number that is none.
  const float end = kSide - 2.0F;
  if (!(low.x() >= 1.0F && low.y() >= 1.0F && high.x() < end && high.y() < end)) return {};
  const int left = static_cast<int>(low.x()) - beyond;
  const int top = static_cast<int>(low.y()) - beyond;
  const int right = static_cast<int>(high.x()) + 1 + beyond;
  const int bottom = static_cast<int>(high.y()) + 1 + beyond;
  if (right - left > kMostSteps || bottom - top > kMostSteps) return {};
  const Plane& plane = planes_[facet];
  const float m_a_step = 2.0F * static_cast<float>(radius_m_) / kSide;
  const float margin =
      kAbove_steps * m_a_step + kAcross_steps * (std::abs(plane.per_x) + std::abs(plane.per_y));
  const float shades = kShades_steps * m_a_step;
  // No number for facets seen edge-on, and where the lamp's direction is none.
  if (!(margin < std::numeric_limits<float>::infinity())) return {};
  Steps steps;
  for (int j = top; j < bottom; ++j) {
    const float* nearness = &nearness_[static_cast<std::size_t>(j) * kSide];
    const float row = plane.at_zero + margin + plane.per_y * static_cast<float>(j) +
                      plane.per_x * TriangleRaster::x_in_step(j);
    // Without a branch: in lanes.
    int above = 0;
    int shading = 0;
    for (int i = left; i < right; ++i) {
      const float height = row + plane.per_y * kYInStep[static_cast<std::size_t>(i)] +
                           plane.per_x * static_cast<float>(i);
      above += nearness[i] > height ? 1 : 0;
      shading += nearness[i] > height + shades ? 1 : 0;
    }
    steps.above += above;
    steps.shading += shading;
    steps.asked += right - left;
    if (mixed_ends && steps.above != 0 && steps.shading != steps.asked) break;
  }
  return steps;
}

Lit LampView::places(std::uint32_t facet, const Eigen::Vector2f& low,
                     const Eigen::Vector2f& high) const noexcept {
  const Steps steps = count(facet, low, high, 1, true);
  if (steps.asked == 0 || (steps.above != 0 && steps.shading != steps.asked)) return Lit::kUnknown;
  return steps.above == 0 ? Lit::kYes : Lit::kNo;
}

float LampView::lit_share(std::uint32_t facet, const Eigen::Vector2f& low,
                          const Eigen::Vector2f& high) const noexcept {
  const Steps steps = count(facet, low, high, 0, false);
  // What stands above a facet's plane by little may or may not shade it: by half.
  const float dark = 0.5F * static_cast<float>(steps.above + steps.shading);
  return 1.0F - dark / static_cast<float>(steps.asked);
}

}  // namespace engine
