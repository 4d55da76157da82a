#include "engine/render/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace engine {
namespace {

// Far outside, yet small enough to become an int.
constexpr double kOutside_px = 1e8;

/// A triangle cut by four straight edges has at most seven corners.
struct Polygon {
  std::array<PixelPoint, 7> corner;
  std::size_t corners = 0;
  void add(const PixelPoint& p) noexcept {
    if (corners < corner.size()) corner[corners++] = p;
  }
};

double area_px2(const Polygon& polygon) noexcept {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.corners; ++i) {
    const PixelPoint& a = polygon.corner[0];
    const PixelPoint& b = polygon.corner[i];
    const PixelPoint& c = polygon.corner[i + 1];
    twice += (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
  }
  return 0.5 * std::abs(twice);
}

/// What lies on the side of `edge` that `sign` points to (Sutherland and Hodgman 1974,
/// DOI 10.1145/360767.360802).
Polygon clipped(const Polygon& in, double PixelPoint::*axis, double edge, double sign) noexcept {
  Polygon out;
  for (std::size_t i = 0; i < in.corners; ++i) {
    const PixelPoint& from = in.corner[i];
    const PixelPoint& to = in.corner[i + 1 < in.corners ? i + 1 : 0];
    const double inside_from = sign * (from.*axis - edge);
    const double inside_to = sign * (to.*axis - edge);
    if (inside_from >= 0.0) out.add(from);
    if ((inside_from < 0.0) != (inside_to < 0.0)) {
      const double t = inside_from / (inside_from - inside_to);
      out.add({from.u + t * (to.u - from.u), from.v + t * (to.v - from.v)});
    }
  }
  return out;
}

}  // namespace

Footprint::Footprint(const CameraGeometry& camera, int beyond_frame_px, std::size_t vertices)
    : camera_(camera), limits_(camera.frame().grown_by(beyond_frame_px)) {
  mask_.resize(static_cast<std::size_t>(limits_.width()) *
               static_cast<std::size_t>(limits_.height()));
  corners_.resize(vertices);
  spans_.resize(static_cast<std::size_t>(limits_.height()));
}

void Footprint::clear() noexcept {
  for (int v = region_.top; v < region_.bottom; ++v) {
    const auto row = mask_.begin() + static_cast<std::ptrdiff_t>(v - limits_.top) * limits_.width();
    std::fill(row + (region_.left - limits_.left), row + (region_.right - limits_.left),
              std::uint8_t{0});
    spans_[static_cast<std::size_t>(v - limits_.top)] = {};
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
    Span& span = spans_[static_cast<std::size_t>(v - limits_.top)];
    span = span.begin == span.end
               ? Span{inside.left, inside.right}
               : Span{std::min(span.begin, inside.left), std::max(span.end, inside.right)};
  }
  region_ = region_.joined_with(inside);
}

PixelRect Footprint::add(const Mesh& mesh, const BodyView& view) noexcept {
  const PixelRect others = std::exchange(region_, PixelRect{});
  const Eigen::Matrix3d camera_from_body = view.body_from_camera.matrix.transpose();
  const LocalCamera camera(camera_, view.image_map);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d in_camera =
        camera_from_body * (mesh.vertices[i].cast<double>() - view.camera.m);
    const PixelPoint p = camera.project(in_camera).value_or(PixelPoint{-kOutside_px, -kOutside_px});
    corners_[i] = {std::clamp(p.u, -kOutside_px, kOutside_px),
                   std::clamp(p.v, -kOutside_px, kOutside_px)};
  }
  for (const Mesh::Triangle& triangle : mesh.triangles) mark(box_round(triangle));
  image_area_ = area_of(mesh);
  const PixelRect own = region_;
  region_ = others.joined_with(own);
  return own;
}

Footprint::ImageArea Footprint::area_of(const Mesh& mesh) const noexcept {
  const PixelRect frame = camera_.frame();
  const double left = frame.left - 0.5;
  const double top = frame.top - 0.5;
  const double right = frame.right - 0.5;
  const double bottom = frame.bottom - 0.5;
  ImageArea sum;
  for (const Mesh::Triangle& triangle : mesh.triangles) {
    Polygon image;
    int within = 0;
    bool behind = false;
    for (const std::uint32_t corner : triangle.corner) {
      const PixelPoint& p = corners_[corner];
      image.add(p);
      behind = behind || p.u == -kOutside_px;
      within += p.u >= left && p.u <= right && p.v >= top && p.v <= bottom ? 1 : 0;
    }
    if (behind) continue;
    const double area = area_px2(image);
    sum.all_px2 += area;
    if (within == 3) {
      sum.in_frame_px2 += area;
      continue;
    }
    image = clipped(image, &PixelPoint::u, left, 1.0);
    image = clipped(image, &PixelPoint::u, right, -1.0);
    image = clipped(image, &PixelPoint::v, top, 1.0);
    image = clipped(image, &PixelPoint::v, bottom, -1.0);
    sum.in_frame_px2 += area_px2(image);
  }
  return sum;
}

}  // namespace engine
