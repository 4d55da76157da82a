#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/utc.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/material.h"
#include "engine/scene/mesh.h"
#include "engine/scene/snapshot.h"

namespace test_support {

/// Table 5 of Li et al. 2023.
[[nodiscard]] inline engine::KeplerElements camera_orbit() {
  using engine::kDegree;
  return {6868.8546e3,        0.0066917,          97.4154 * kDegree,
          140.0776 * kDegree, 200.0074 * kDegree, 183.0867 * kDegree};
}
[[nodiscard]] inline engine::KeplerElements target_orbit() {
  using engine::kDegree;
  return {6796.7142e3,        0.0006096,         51.6417 * kDegree,
          117.6201 * kDegree, 40.2943 * kDegree, 7.3764 * kDegree};
}
[[nodiscard]] inline engine::Epoch epoch_2022() {
  return engine::epoch_from_utc("2022-01-01T00:00:00").value();
}

/// The two satellites of the paper from an epoch on.
struct Flyby {
  explicit Flyby(engine::Epoch start = epoch_2022())
      : epoch(start), camera(camera_orbit(), start), target(target_orbit(), start) {}
  engine::Epoch epoch;
  engine::KeplerPropagator camera;
  engine::KeplerPropagator target;
  /// Seconds after the epoch.
  [[nodiscard]] engine::Epoch at(double t_s) const { return epoch + engine::from_seconds(t_s); }
};

/// Closest approach of pass 3 of range_windows_15d.csv, in seconds after the epoch.
inline constexpr double kClosestOfPass3_s = 309781.705969;

[[nodiscard]] inline engine::FiveParameters silicon() {
  return {0.557, -261.6, 15.42, 0.047, 0.717};
}
[[nodiscard]] inline engine::FiveParameters polyimide() {
  return {0.458, -51.90, 28.38, 0.077, 1.865};
}
[[nodiscard]] inline engine::FiveParameters lambert(double albedo) {
  return {1.0, -1.0, 0.0, albedo / engine::kPi, 1.0};
}
[[nodiscard]] inline engine::Material lambert_material(const std::string& name, double albedo) {
  return {name, lambert(albedo)};
}
[[nodiscard]] inline std::vector<engine::Material> telescope_materials() {
  return {{"silicon", silicon()}, {"polyimide", polyimide()}, {"black", lambert(0.03)}};
}

/// A camera of few pixels with the paper's optics.
[[nodiscard]] inline engine::CameraGeometry small_camera(int side_px) {
  engine::CameraGeometry camera;
  camera.width_px = side_px;
  camera.height_px = side_px;
  return camera;
}

/// A parallelogram: corner, corner + a, corner + a + b, corner + b.
inline void add_plate(engine::Mesh& mesh, const std::string& material,
                      const Eigen::Vector3f& corner, const Eigen::Vector3f& a,
                      const Eigen::Vector3f& b) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3f& v : {corner, Eigen::Vector3f(corner + a),
                                   Eigen::Vector3f(corner + a + b), Eigen::Vector3f(corner + b)})
    mesh.vertices.push_back(v);
  const std::uint32_t id = mesh.material(material);
  mesh.triangles.push_back({{first, first + 1, first + 2}, id});
  mesh.triangles.push_back({{first, first + 2, first + 3}, id});
}

/// A sphere of 2 * rings * sectors - 2 * sectors triangles about the origin.
[[nodiscard]] inline engine::Mesh sphere(float radius_m, int rings, int sectors,
                                         const std::string& material) {
  engine::Mesh mesh;
  const std::uint32_t id = mesh.material(material);
  for (int i = 0; i <= rings; ++i) {
    const double theta = engine::kPi * i / rings;
    const double across = i == 0 || i == rings ? 0.0 : std::sin(theta);  // a pole is one place
    for (int j = 0; j < sectors; ++j) {
      const double phi = 2.0 * engine::kPi * j / sectors;
      const Eigen::Vector3d unit(across * std::cos(phi), across * std::sin(phi), std::cos(theta));
      mesh.vertices.push_back((radius_m * unit).cast<float>());
    }
  }
  const auto vertex = [&](int i, int j) {
    return static_cast<std::uint32_t>(i * sectors + j % sectors);
  };
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      if (i > 0) mesh.triangles.push_back({{vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)}, id});
      if (i + 1 < rings)
        mesh.triangles.push_back({{vertex(i, j + 1), vertex(i + 1, j), vertex(i + 1, j + 1)}, id});
    }
  }
  return mesh;
}

/// A camera at `place` in the body frame that looks along `boresight`, x to the right as seen with
/// `up` at the top.
[[nodiscard]] inline engine::Snapshot view_from(const Eigen::Vector3d& place,
                                                const Eigen::Vector3d& boresight,
                                                const Eigen::Vector3d& up) {
  engine::Snapshot snapshot;
  snapshot.seed = 1;
  snapshot.camera.m = place;
  snapshot.range_m = place.norm();
  const Eigen::Vector3d z = boresight.normalized();
  const Eigen::Vector3d x = z.cross(up).normalized();
  snapshot.body_from_camera.matrix.col(0) = x;
  snapshot.body_from_camera.matrix.col(1) = z.cross(x);
  snapshot.body_from_camera.matrix.col(2) = z;
  return snapshot;
}
/// The same, looking at the body's origin.
[[nodiscard]] inline engine::Snapshot look_at_origin(const Eigen::Vector3d& place,
                                                     const Eigen::Vector3d& up) {
  return view_from(place, -place, up);
}

/// One body more, at `centre` in the target's body frame and turned by `turn`, in the same light.
inline engine::CompanionView& add_companion(
    engine::Snapshot& snapshot, const Eigen::Vector3d& centre,
    const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
  engine::CompanionView& view = snapshot.companion[snapshot.companions++];
  view.centre.m = centre;
  view.from_target.matrix = turn;
  view.camera.m = turn * (snapshot.camera.m - centre);
  view.range_m = view.camera.m.norm();
  view.body_from_camera.matrix = turn * snapshot.body_from_camera.matrix;
  view.sun = {view.from_target * snapshot.sun.toward, snapshot.sun.irradiance_w_m2};
  view.earthshine = {view.from_target * snapshot.earthshine.toward,
                     snapshot.earthshine.irradiance_w_m2};
  return view;
}

}  // namespace test_support
