#include "engine/render/footprint.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

// Far outside, yet small enough to become an int.
constexpr double kOutside_px = 1e8;

}  // namespace

Footprint::Footprint(const CameraGeometry& camera, int beyond_frame_px, std::size_t vertices)
    : camera_(camera), limits_(camera.frame().grown_by(beyond_frame_px)) {
  mask_.resize(static_cast<std::size_t>(limits_.width()) *
               static_cast<std::size_t>(limits_.height()));
  corners_.resize(vertices);
}

void Footprint::clear() noexcept {
  for (int v = region_.top; v < region_.bottom; ++v) {
    const auto row = mask_.begin() + static_cast<std::ptrdiff_t>(v - limits_.top) * limits_.width();
    std::fill(row + (region_.left - limits_.left), row + (region_.right - limits_.left),
              std::uint8_t{0});
  }
  region_ = {};
}

PixelRect Footprint::box_round(const Mesh::Triangle& triangle) const noexcept {
  double low_u = kOutside_px;
  double low_v = kOutside_px;
  double high_u = -kOutside_px;
  double high_v = -kOutside_px;
  for (const std::uint32_t corner : triangle.corner) {
    const PixelPoint& p = corners_[corner];
    low_u = std::min(low_u, p.u);
    high_u = std::max(high_u, p.u);
    low_v = std::min(low_v, p.v);
    high_v = std::max(high_v, p.v);
  }
  // A pixel reaches half a pixel to each side of its centre.
  return PixelRect{static_cast<int>(std::floor(low_u + 0.5)),
                   static_cast<int>(std::floor(low_v + 0.5)),
                   static_cast<int>(std::floor(high_u + 0.5)) + 1,
                   static_cast<int>(std::floor(high_v + 0.5)) + 1};
}

void Footprint::mark(const PixelRect& box) noexcept {
  const PixelRect inside = box.clipped_to(limits_);
  if (inside.empty()) return;
  for (int v = inside.top; v < inside.bottom; ++v) {
    const auto row = mask_.begin() + static_cast<std::ptrdiff_t>(v - limits_.top) * limits_.width();
    std::fill(row + (inside.left - limits_.left), row + (inside.right - limits_.left),
              std::uint8_t{1});
  }
  if (region_.empty()) {
    region_ = inside;
    return;
  }
  region_ = {std::min(region_.left, inside.left), std::min(region_.top, inside.top),
             std::max(region_.right, inside.right), std::max(region_.bottom, inside.bottom)};
}

void Footprint::project(const Mesh& mesh, const Snapshot& snapshot) noexcept {
  clear();
  const Eigen::Matrix3d camera_from_body = snapshot.body_from_camera.matrix.transpose();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d in_camera =
        camera_from_body * (mesh.vertices[i].cast<double>() - snapshot.camera.m);
    const PixelPoint p =
        camera_.project(in_camera).value_or(PixelPoint{-kOutside_px, -kOutside_px});
    corners_[i] = {std::clamp(p.u, -kOutside_px, kOutside_px),
                   std::clamp(p.v, -kOutside_px, kOutside_px)};
  }
  for (const Mesh::Triangle& triangle : mesh.triangles) mark(box_round(triangle));
}

}  // namespace engine
