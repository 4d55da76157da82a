#include "engine/scene/camera_geometry.h"

#include <algorithm>
#include <limits>
#include <string>

#include <Eigen/LU>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMostSteps = 20;
constexpr double kClose_tan = 1e-14;
// An image that moves as fast as the rows are read has no end; up to here it is stretched.
constexpr double kFastestOfRows = 0.5;

}  // namespace

Vector2d Distortion::apply(const Vector2d& straight) const noexcept {
  const double x = straight.x();
  const double y = straight.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y)};
}

Matrix2d Distortion::slope(const Vector2d& straight) const noexcept {
  const double x = straight.x();
  const double y = straight.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double by_r2 = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
  const double across = 2.0 * x * y * by_r2 + 2.0 * p1 * x + 2.0 * p2 * y;
  Matrix2d m;
  m << radial + 2.0 * x * x * by_r2 + 2.0 * p1 * y + 6.0 * p2 * x, across, across,
      radial + 2.0 * y * y * by_r2 + 6.0 * p1 * y + 2.0 * p2 * x;
  return m;
}

Vector2d Distortion::undo(const Vector2d& bent) const noexcept {
  Vector2d straight = bent;
  for (int i = 0; i < kMostSteps; ++i) {
    const Vector2d off = apply(straight) - bent;
    if (off.norm() <= kClose_tan * (1.0 + bent.norm())) return straight;
    straight -= slope(straight).inverse() * off;
  }
  return Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
}

double CameraGeometry::half_diagonal_field_rad() const noexcept {
  double most = 0;
  for (const double u : {0.0, 1.0 * width_px}) {
    for (const double v : {0.0, 1.0 * height_px}) {
      const Vector3d corner = direction_at({u, v});
      most = std::max(most, std::atan(std::hypot(corner.x(), corner.y())));
    }
  }
  return most;
}

double CameraGeometry::sensor_half_diagonal_px() const noexcept {
  return 0.5 * std::hypot(window.sensor_width_px > 0 ? window.sensor_width_px : width_px,
                          window.sensor_height_px > 0 ? window.sensor_height_px : height_px);
}

std::optional<PixelPoint> CameraGeometry::project(const Vector3d& in_camera) const noexcept {
  if (distortion.none()) return project_straight(in_camera);
  if (!(in_camera.z() > 0.0)) return std::nullopt;
  const Vector2d straight = in_camera.head<2>() / in_camera.z();
  if (!(straight.norm() <= distortion.reach_tan)) return std::nullopt;
  const Vector2d bent = distortion.apply(straight);
  return PixelPoint{principal_point().u + pixels_per_radian() * bent.x(),
                    principal_point().v + pixels_per_radian() * bent.y()};
}

Vector3d CameraGeometry::direction_at(PixelPoint p) const noexcept {
  const Vector3d bent = straight_direction_at(p);
  if (distortion.none()) return bent;
  const Vector2d straight = distortion.undo(bent.head<2>());
  return {straight.x(), straight.y(), 1.0};
}

std::optional<AffineMap> CameraGeometry::map_near(const Vector3d& in_camera, PixelPoint motion_px,
                                                  double exposure_s) const noexcept {
  const auto straight = project_straight(in_camera);
  const auto bent = project(in_camera);
  if (!straight || !bent) return std::nullopt;
  AffineMap map;
  if (!distortion.none()) {
    map.slope = distortion.slope(in_camera.head<2>() / in_camera.z());
    map.shift = Vector2d(bent->u, bent->v) - map.slope * Vector2d(straight->u, straight->v);
  }
  if (row_time_s == 0.0) return map;
  // Row v shows the image as it is (v - middle) row times later: u' = u + a (v' - middle).
  const double rows = row_time_s / exposure_s;
  const double down = std::min(motion_px.v * rows, kFastestOfRows);
  const Vector2d a(motion_px.u * rows, down);
  if (!a.allFinite()) return std::nullopt;
  AffineMap rolled;
  rolled.slope << 1.0, a.x() / (1.0 - a.y()), 0.0, 1.0 / (1.0 - a.y());
  const Vector2d middle(0.0, principal_point().v);
  rolled.shift = middle - rolled.slope * middle;
  return AffineMap{rolled.slope * map.slope, rolled.slope * map.shift + rolled.shift};
}

namespace {

/// Photosites to pixels as they are read out.
int binned(const ConfigTable& table, const std::string& key, double photosites, int binning) {
  const auto whole = static_cast<int>(photosites);
  if (whole % binning != 0)
    table.fail(key, "must be a multiple of the binning, " + std::to_string(binning) + ", got " +
                        std::to_string(whole));
  return whole / binning;
}

void read_window(const ConfigTable& table, CameraGeometry& camera) {
  constexpr int kSmallest = 16;
  SensorWindow& window = camera.window;
  window.binning = static_cast<int>(table.integer_or("binning", 1, between(1, 4)));
  const int b = window.binning;
  const int width = camera.width_px;
  const int height = camera.height_px;
  window.sensor_width_px = binned(table, "width_px", width, b);
  window.sensor_height_px = binned(table, "height_px", height, b);
  const auto read = [&](const std::string& key, int fallback, int low, int high) {
    return binned(table, key,
                  static_cast<double>(table.integer_or(key, fallback, between(low, high))), b);
  };
  window.left_px = read("window_left_px", 0, 0, width - kSmallest);
  window.top_px = read("window_top_px", 0, 0, height - kSmallest);
  camera.width_px =
      read("window_width_px", width - window.left_px * b, kSmallest, width - window.left_px * b);
  camera.height_px =
      read("window_height_px", height - window.top_px * b, kSmallest, height - window.top_px * b);
  if (camera.width_px < kSmallest || camera.height_px < kSmallest)
    table.fail("binning", "leaves frames of " + std::to_string(camera.width_px) + " x " +
                              std::to_string(camera.height_px) + " pixels, fewer than 16");
  camera.pixel_pitch_m *= b;
}

/// A distortion that folds the image has no way back: from the middle outwards, and further than
/// the sensor's corners, for light from there blurs in.
void check(const ConfigTable& table, CameraGeometry& camera) {
  constexpr int kDirections = 64;
  constexpr int kSteps = 64;
  constexpr double kBeyond = 1.25;
  constexpr double kBeyond_px = 120;  // at the least: more than what optics and Earth ask for
  constexpr double kLeastStretch = 0.1;
  if (camera.distortion.none()) return;
  double straight_reach = 0;
  const double corner_px = camera.sensor_half_diagonal_px();
  const double reach = std::max(kBeyond * corner_px, corner_px + kBeyond_px) * camera.ifov_rad();
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * kPi * i / kDirections;
    const Vector2d bent = reach * Vector2d(std::cos(angle), std::sin(angle));
    const Vector2d straight = camera.distortion.undo(bent);
    bool folds = !straight.allFinite() || straight.dot(bent) <= 0.0;
    for (int k = 1; !folds && k <= kSteps; ++k) {
      const Matrix2d slope = camera.distortion.slope(straight * k / kSteps);
      folds = !(slope.determinant() > kLeastStretch && slope.trace() > 0.0);
    }
    straight_reach = std::max(straight_reach, straight.norm());
    if (folds)
      table.fail("distortion_k1", "and the other terms fold the image within " +
                                      std::to_string(static_cast<int>(reach / camera.ifov_rad())) +
                                      " px of its middle: no direction falls there, or several");
  }
  camera.distortion.reach_tan = straight_reach;
}

}  // namespace

CameraGeometry read_camera_geometry(const ConfigTable& table) {
  CameraGeometry camera;
  camera.focal_length_m = table.number("focal_length_m", positive());
  camera.pixel_pitch_m = table.number("pixel_pitch_um", positive()) * 1e-6;
  camera.width_px = static_cast<int>(table.integer("width_px", between(16, 4096)));
  camera.height_px = static_cast<int>(table.integer("height_px", between(16, 4096)));
  read_window(table, camera);
  Distortion& d = camera.distortion;
  const auto term = [&](const std::string& key) { return table.number_or(key, 0.0, any_number()); };
  d.k1 = term("distortion_k1");
  d.k2 = term("distortion_k2");
  d.k3 = term("distortion_k3");
  d.p1 = term("distortion_p1");
  d.p2 = term("distortion_p2");
  check(table, camera);
  camera.row_time_s = 1e-6 * table.number_or("row_time_us", 0.0, between(0.0, 1e6));
  return camera;
}

}  // namespace engine
