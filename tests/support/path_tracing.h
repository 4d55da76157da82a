#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/render/path_tracer.h"
#include "tests/support/scenes.h"

/// What tests of the path tracer begin with: a plate or another mesh before a small camera, and the
/// light that comes of it.
namespace test_support {

inline constexpr double kSun_w_m2 = 634.64;
inline constexpr double kRange_m = 100e3;  // a pixel is .144 m there
inline const Eigen::Vector3d kUp(0, 1, 0);

[[nodiscard]] inline engine::RenderSpec spec_of(int side_px, int bounces = 0) {
  engine::RenderSpec spec;
  spec.bounces = bounces;
  spec.camera = small_camera(side_px);
  spec.grid.beyond_frame_px = 16;
  return spec;
}

[[nodiscard]] inline engine::Mesh plate(float side_m = 6.0F) {
  engine::Mesh mesh;
  add_plate(mesh, "white", {-side_m / 2, -side_m / 2, 0}, {side_m, 0, 0}, {0, side_m, 0});
  return mesh;
}

[[nodiscard]] inline engine::Direction<engine::BodyFrame> toward(const Eigen::Vector3d& v) {
  return engine::direction_of<engine::BodyFrame>(v);
}

/// Camera above the plate, Sun in the x-z plane.
[[nodiscard]] inline engine::Snapshot above(double sun_deg, double sun_w_m2 = kSun_w_m2) {
  engine::Snapshot snapshot = look_at_origin({0, 0, kRange_m}, kUp);
  const double a = sun_deg * engine::kDegree;
  snapshot.sun = {toward({std::sin(a), 0, std::cos(a)}), sun_w_m2};
  return snapshot;
}

[[nodiscard]] inline double sum_of(const engine::Radiance& light) {
  double total = 0;
  for (const float x : light.grid.pixels()) total += static_cast<double>(x);
  return total;
}

struct Rendered {
  engine::Radiance light;
  engine::RenderReport report;

  /// Of the nine cells of a pixel, by its place on the detector.
  [[nodiscard]] std::array<float, 9> cells(int u, int v) const {
    std::array<float, 9> out{};
    for (int i = 0; i < 9; ++i) {
      out[static_cast<std::size_t>(i)] =
          light.grid.at(3 * (u - light.region.left) + i % 3, 3 * (v - light.region.top) + i / 3);
    }
    return out;
  }
  [[nodiscard]] double mean(int u, int v) const {
    double sum = 0;
    for (const float c : cells(u, v)) sum += static_cast<double>(c);
    return sum / 9.0;
  }
  [[nodiscard]] double sum() const { return sum_of(light); }
};

[[nodiscard]] inline Rendered render(const engine::RenderSpec& spec, const engine::Mesh& mesh,
                                     const std::vector<engine::Material>& materials,
                                     const engine::Snapshot& snapshot, int threads = 1,
                                     engine::Budget budget = {}) {
  engine::WorkerPool pool(threads);
  engine::PathTracer tracer(spec, std::make_shared<engine::TracedTarget>(mesh, materials), pool);
  Rendered out;
  out.report = tracer.render(snapshot, budget, out.light);
  return out;
}

}  // namespace test_support
