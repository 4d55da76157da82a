#include "engine/render/lattice_view.h"

#include <algorithm>

#include "engine/core/contract.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

// The nearest a target may be, in its own radii from its centre.
constexpr double kNearest = 2.0;

// The flux of 800 points across a telescope is good to .1 % rms, of 400 to .3 %.
constexpr int kAcross = 800;
// So large, a target has few edges a pixel: from 30 km down a quarter of the points is .6 sigma off
// where all are .4 to .6, and takes half to a third of the time.
constexpr int kMostAcross = 5400;
constexpr int kCoarse = 4;

}  // namespace

LatticeView::LatticeView(const RenderSpec& spec, std::shared_ptr<const TracedTarget> target)
    : camera_(spec.camera),
      oversampling_(spec.grid.oversampling),
      target_(std::move(target)),
      footprint_(spec.camera, spec.grid.beyond_frame_px, target_->mesh.vertices.size()),
      raster_(target_->mesh.vertices.size(), target_->mesh.triangles.size(),
              spec.camera.frame().grown_by(spec.grid.beyond_frame_px).height()),
      corners_(target_->mesh.vertices.size()) {}

std::size_t LatticeView::most_points(const RenderSpec& spec) noexcept {
  const int wide = spec.camera.frame().grown_by(spec.grid.beyond_frame_px).width();
  const int plain = spec.grid.oversampling * (spec.lattice_side > 0 ? spec.lattice_side : kCoarse);
  ENSURE(plain <= TriangleRaster::kMostBandRows);
  const auto points = [](int columns, int rows) {
    return static_cast<std::size_t>(columns + TriangleRaster::kLanes) *
           static_cast<std::size_t>(rows);
  };
  return std::max(points(wide * plain, plain), points(2 * kAcross, TriangleRaster::kMostBandRows));
}

int LatticeView::side_of(int wanted, int most) const noexcept {
  const int s = oversampling_;
  int side = wanted > 0 ? wanted : kCoarse;
  const int across = s * std::max(region().width(), region().height());
  while (wanted == 0 && across * side < kAcross && 2 * s * side <= TriangleRaster::kMostBandRows)
    side *= 2;
  if (wanted == 0 && across * side > kMostAcross) side /= 2;
  while (side > 2 && most > 0 && s * s * side * side > most) side /= 2;
  return side;
}

bool LatticeView::place(const Snapshot& snapshot, int side, int most) noexcept {
  footprint_.project(target_->mesh, snapshot);
  const PixelRect region = footprint_.region();
  side_ = side_of(side, most);
  points_a_pixel_ = oversampling_ * side_;
  const double range_m = snapshot.camera.m.norm();
  // Not a number either.
  if (!(range_m > kNearest * target_->bounding_radius_m)) return false;
  const Matrix3d& axes = snapshot.body_from_camera.matrix;
  const Matrix3d camera_from_body = axes.transpose();
  const LocalCamera camera(camera_, snapshot.image_map);
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Vector3d p =
        camera_from_body * (target_->mesh.vertices[i].cast<double>() - snapshot.camera.m);
    const auto at = camera.project(p);
    if (!at) return false;
    // 1/z is linear on the detector; from the target's centre and in its radii it keeps its digits.
    corners_[i] = {(at->u + 0.5 - region.left) * points_a_pixel_,
                   (at->v + 0.5 - region.top) * points_a_pixel_,
                   (range_m - p.z()) / p.z() * (range_m / target_->bounding_radius_m)};
  }
  if (!raster_.place(target_->mesh, corners_, region.width() * points_a_pixel_,
                     region.height() * points_a_pixel_, points_a_pixel_))
    return false;
  const Vector3d at_zero = axes * camera.direction_at({region.left - 0.5, region.top - 0.5});
  const Vector3d per_x = axes * camera.direction_per_u() / points_a_pixel_;
  const Vector3d per_y = axes * camera.direction_per_v() / points_a_pixel_;
  const double advance = range_m - 1.2 * target_->bounding_radius_m;
  start_ = (snapshot.camera.m + advance * at_zero).cast<float>();
  start_per_x_ = (advance * per_x).cast<float>();
  start_per_y_ = (advance * per_y).cast<float>();
  direction_ = at_zero.cast<float>();
  direction_per_x_ = per_x.cast<float>();
  direction_per_y_ = per_y.cast<float>();
  return true;
}

SurfacePoint LatticeView::place_on(std::uint32_t facet, float x, float y,
                                   Vector3f& direction) const noexcept {
  direction = direction_ + x * direction_per_x_ + y * direction_per_y_;
  return target_->facets.on_plane(facet, start_ + x * start_per_x_ + y * start_per_y_, direction);
}

}  // namespace engine
