#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "tests/support/path_tracing.h"

/// A small scene with Monte Carlo noise, its converged image, and how far another one is from that
/// as a sensor would see it.
namespace test_support {

/// A camera in a hurry: 1 W/m^2/sr is so many electrons.
inline const engine::SensorNoise kSensor{10.0, 22.2, 30000.0, 0.68};

/// Plates in a corner: edges, a shadow, and light that bounces.
struct Corner {
  Corner() {
    engine::Mesh mesh;
    add_plate(mesh, "grey", {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
    add_plate(mesh, "grey", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
    target = std::make_shared<engine::TracedTarget>(
        mesh, std::vector<engine::Material>{lambert_material("grey", 0.5)});
    snapshot = look_at_origin({136e3, 34e3, 85e3}, {0, 0, 1});
    snapshot.sun = {toward({-0.2, 0.3, 1}), kSun_w_m2};
    spec = spec_of(64, 1);
    spec.noise = kSensor;
  }
  std::shared_ptr<engine::TracedTarget> target;
  engine::Snapshot snapshot;
  engine::RenderSpec spec;
};

/// The image that a scene has, from many samples of many seeds, by pixel.
inline std::vector<double> converged(const engine::RenderSpec& spec,
                                     const std::shared_ptr<engine::TracedTarget>& target,
                                     engine::Snapshot snapshot, int seeds, int samples) {
  engine::WorkerPool pool(2);
  engine::PathTracer tracer(spec, target, pool);
  std::vector<double> sum;
  for (int seed = 0; seed < seeds; ++seed) {
    snapshot.seed = 1000 + static_cast<std::uint64_t>(seed);
    engine::Radiance light;
    static_cast<void>(tracer.render(snapshot, {samples}, light));
    sum.resize(light.grid.pixels().size());
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += static_cast<double>(light.grid.pixels()[i]) / seeds;
  }
  return sum;
}

/// Errors of an image by lit pixel, after a Gaussian of 0.68 px on the grid's cells, over the
/// sensor's sigma. Written once more, cell by cell.
inline std::vector<double> true_errors(const engine::Radiance& light,
                                       const std::vector<double>& truth) {
  const int width = light.grid.width();
  const int height = light.grid.height();
  const double blur_cells = 0.68 * 3.0;
  const auto spread = [&](const std::vector<double>& in) {
    std::vector<double> lines(in.size());
    std::vector<double> out(in.size());
    for (int pass = 0; pass < 2; ++pass) {
      const std::vector<double>& from = pass == 0 ? in : lines;
      std::vector<double>& to = pass == 0 ? lines : out;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          double sum = 0;
          for (int k = -10; k <= 10; ++k) {
            const int at_x = pass == 0 ? x + k : x;
            const int at_y = pass == 0 ? y : y + k;
            if (at_x < 0 || at_y < 0 || at_x >= width || at_y >= height) continue;
            sum += from[static_cast<std::size_t>(at_y * width + at_x)] *
                   std::exp(-0.5 * k * k / (blur_cells * blur_cells)) /
                   (blur_cells * std::sqrt(2.0 * engine::kPi));
          }
          to[static_cast<std::size_t>(y * width + x)] = sum;
        }
      }
    }
    return out;
  };
  std::vector<double> error(truth.size());
  for (std::size_t i = 0; i < error.size(); ++i)
    error[i] = static_cast<double>(light.grid.pixels()[i]) - truth[i];
  const std::vector<double> blurred = spread(error);
  const std::vector<double> signal = spread(truth);
  std::vector<double> errors;
  for (int y = 1; y < height; y += 3) {
    for (int x = 1; x < width; x += 3) {
      const auto i = static_cast<std::size_t>(y * width + x);
      const double mean_e = signal[i] * kSensor.e_per_radiance;
      if (mean_e <= kSensor.sigma_e(0.0) || mean_e >= kSensor.full_well_e) continue;
      errors.push_back(blurred[i] * kSensor.e_per_radiance / kSensor.sigma_e(mean_e));
    }
  }
  return errors;
}

}  // namespace test_support
