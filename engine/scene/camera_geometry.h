#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "engine/core/config_reader.h"
#include "engine/core/image.h"
#include "engine/core/vec.h"

namespace engine {

/// Brown-Conrady, in OpenCV's order and signs: with x = X/Z, y = Y/Z and r^2 = x^2 + y^2,
/// x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and y' as that with x and
/// y, p1 and p2 exchanged. Brown 1966, Photogrammetric Engineering 32(3) 444-462.
struct Distortion {
  double k1 = 0, k2 = 0, k3 = 0;
  double p1 = 0, p2 = 0;
  /// As far from the axis as the terms are good for: beyond, they may fold the image, and nothing
  /// is seen.
  double reach_tan = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool none() const noexcept {
    return k1 == 0.0 && k2 == 0.0 && k3 == 0.0 && p1 == 0.0 && p2 == 0.0;
  }
  [[nodiscard]] Eigen::Vector2d apply(const Eigen::Vector2d& straight) const noexcept;
  /// How it changes about there.
  [[nodiscard]] Eigen::Matrix2d slope(const Eigen::Vector2d& straight) const noexcept;
  /// What apply() makes `bent` of, by Newton's method; not finite when there is none near by.
  [[nodiscard]] Eigen::Vector2d undo(const Eigen::Vector2d& bent) const noexcept;
};

/// What of the sensor is read out.
struct SensorWindow {
  int left_px = 0;  ///< of the window, in pixels as they are read out
  int top_px = 0;
  int sensor_width_px = 0;  ///< as they are read out; 0: the window's
  int sensor_height_px = 0;
  int binning = 1;  ///< photosites on a side of a pixel
};

/// A map of the image's plane onto itself that keeps lines straight and parallel.
struct AffineMap {
  Eigen::Matrix2d slope = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  [[nodiscard]] PixelPoint apply(PixelPoint p) const noexcept {
    return {slope(0, 0) * p.u + slope(0, 1) * p.v + shift.x(),
            slope(1, 0) * p.u + slope(1, 1) * p.v + shift.y()};
  }
  [[nodiscard]] AffineMap inverse() const noexcept {
    const Eigen::Matrix2d back = slope.inverse();
    return {back, -back * shift};
  }
};

/// The pinhole of table 4 and eq 9 of Li et al. 2023, its distortion, and what of its image the
/// sensor reads out: where a direction falls on the detector.
struct CameraGeometry {
  double focal_length_m = 4.5;
  double pixel_pitch_m = 6.5e-6;  ///< of pixels as they are read out
  int width_px = 1024;            ///< of the frames
  int height_px = 1024;
  Distortion distortion;
  SensorWindow window;
  double row_time_s = 0;  ///< a row is exposed so much later than the one above it; 0: all at once

  /// The boresight's place: the centre of the sensor's photosite (width/2, height/2).
  [[nodiscard]] PixelPoint principal_point() const noexcept {
    const auto centre = [this](int sensor, int frame, int from) {
      const double photosite = std::floor(0.5 * (sensor > 0 ? sensor : frame) * window.binning);
      return (photosite + 0.5) / window.binning - 0.5 - from;
    };
    return {centre(window.sensor_width_px, width_px, window.left_px),
            centre(window.sensor_height_px, height_px, window.top_px)};
  }
  [[nodiscard]] double pixels_per_radian() const noexcept { return focal_length_m / pixel_pitch_m; }
  [[nodiscard]] double ifov_rad() const noexcept { return pixel_pitch_m / focal_length_m; }
  /// Between the boresight and the furthest corner of the frame.
  [[nodiscard]] double half_diagonal_field_rad() const noexcept;
  /// From the principal point to the corners of the sensor.
  [[nodiscard]] double sensor_half_diagonal_px() const noexcept;
  [[nodiscard]] PixelRect frame() const noexcept { return {0, 0, width_px, height_px}; }

  /// All of its image is what project_straight() says, at any time.
  [[nodiscard]] bool straight() const noexcept { return distortion.none() && row_time_s == 0.0; }
  /// Nothing for what lies behind the camera. A rolling shutter is none of its business.
  [[nodiscard]] std::optional<PixelPoint> project(const Eigen::Vector3d& in_camera) const noexcept;
  /// The direction that falls on a place of the detector; not of unit length, z = 1.
  [[nodiscard]] Eigen::Vector3d direction_at(PixelPoint p) const noexcept;

  /// The same without distortion.
  [[nodiscard]] std::optional<PixelPoint> project_straight(
      const Eigen::Vector3d& in_camera) const noexcept {
    if (!(in_camera.z() > 0.0)) return std::nullopt;
    const double scale = pixels_per_radian() / in_camera.z();
    return PixelPoint{principal_point().u + scale * in_camera.x(),
                      principal_point().v + scale * in_camera.y()};
  }
  [[nodiscard]] Eigen::Vector3d straight_direction_at(PixelPoint p) const noexcept {
    return {(p.u - principal_point().u) * ifov_rad(), (p.v - principal_point().v) * ifov_rad(),
            1.0};
  }

  /// What distortion and a rolling shutter make of project_straight() near a direction: the former
  /// to first order, the latter of an image that moves evenly, by `motion_px` over `exposure_s`;
  /// one that runs down faster than half as fast as the rows are read is stretched as at that.
  /// Nothing for what lies behind.
  [[nodiscard]] std::optional<AffineMap> map_near(const Eigen::Vector3d& in_camera,
                                                  PixelPoint motion_px,
                                                  double exposure_s) const noexcept;
};

/// Table [camera] of a scenario.
[[nodiscard]] CameraGeometry read_camera_geometry(const ConfigTable& table);

/// The camera near one place of its image, where it is as good as a pinhole whose image an affine
/// map moves: what renderers see through.
class LocalCamera {
 public:
  LocalCamera(const CameraGeometry& camera, const AffineMap& map) noexcept
      : camera_(camera), map_(map), back_(map.inverse()) {}

  [[nodiscard]] std::optional<PixelPoint> project(const Eigen::Vector3d& in_camera) const noexcept {
    const auto straight = camera_.project_straight(in_camera);
    if (!straight) return std::nullopt;
    return map_.apply(*straight);
  }
  [[nodiscard]] Eigen::Vector3d direction_at(PixelPoint p) const noexcept {
    return camera_.straight_direction_at(back_.apply(p));
  }
  /// How that changes by a pixel.
  [[nodiscard]] Eigen::Vector3d direction_per_u() const noexcept {
    return {back_.slope(0, 0) * camera_.ifov_rad(), back_.slope(1, 0) * camera_.ifov_rad(), 0.0};
  }
  [[nodiscard]] Eigen::Vector3d direction_per_v() const noexcept {
    return {back_.slope(0, 1) * camera_.ifov_rad(), back_.slope(1, 1) * camera_.ifov_rad(), 0.0};
  }
  /// How many times longer the longest line is than without the map.
  [[nodiscard]] double stretch() const noexcept { return map_.slope.norm(); }
  [[nodiscard]] const AffineMap& map() const noexcept { return map_; }

 private:
  const CameraGeometry& camera_;
  const AffineMap& map_;
  AffineMap back_;
};

}  // namespace engine
