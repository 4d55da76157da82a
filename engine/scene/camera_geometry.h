#pragma once

#include <cmath>
#include <optional>

#include "engine/core/config_reader.h"
#include "engine/core/image.h"
#include "engine/core/vec.h"

namespace engine {

/// The pinhole of table 4 and eq 9 of Li et al. 2023: where a direction falls on the detector.
/// Leaves out distortion.
struct CameraGeometry {
  double focal_length_m = 4.5;
  double pixel_pitch_m = 6.5e-6;
  int width_px = 1024;
  int height_px = 1024;

  /// The boresight's place: the centre of pixel (width/2, height/2).
  [[nodiscard]] PixelPoint principal_point() const noexcept {
    return {std::floor(0.5 * width_px), std::floor(0.5 * height_px)};
  }
  [[nodiscard]] double pixels_per_radian() const noexcept { return focal_length_m / pixel_pitch_m; }
  [[nodiscard]] double ifov_rad() const noexcept { return pixel_pitch_m / focal_length_m; }
  [[nodiscard]] double half_diagonal_field_rad() const noexcept {
    return std::atan(0.5 * std::hypot(width_px, height_px) * ifov_rad());
  }
  [[nodiscard]] PixelRect frame() const noexcept { return {0, 0, width_px, height_px}; }

  /// Nothing for what lies behind the camera.
  [[nodiscard]] std::optional<PixelPoint> project(const Eigen::Vector3d& in_camera) const noexcept {
    if (!(in_camera.z() > 0.0)) return std::nullopt;
    const double scale = pixels_per_radian() / in_camera.z();
    return PixelPoint{principal_point().u + scale * in_camera.x(),
                      principal_point().v + scale * in_camera.y()};
  }
  /// The direction that falls on a place of the detector; not of unit length, z = 1.
  [[nodiscard]] Eigen::Vector3d direction_at(PixelPoint p) const noexcept {
    return {(p.u - principal_point().u) * ifov_rad(), (p.v - principal_point().v) * ifov_rad(),
            1.0};
  }
};

[[nodiscard]] inline CameraGeometry read_camera_geometry(const ConfigTable& table) {
  CameraGeometry camera;
  camera.focal_length_m = table.number("focal_length_m", positive());
  camera.pixel_pitch_m = table.number("pixel_pitch_um", positive()) * 1e-6;
  camera.width_px = static_cast<int>(table.integer("width_px", between(16, 4096)));
  camera.height_px = static_cast<int>(table.integer("height_px", between(16, 4096)));
  return camera;
}

}  // namespace engine
