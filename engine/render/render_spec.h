#pragma once

#include <memory>

#include "engine/core/config_reader.h"
#include "engine/core/worker_pool.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

struct TracedTarget;

enum class RenderMethod : std::uint8_t {
  kLattice,  ///< LatticeRenderer: coverage from a lattice of points, light kept on the body
  kPaths     ///< PathTracer: the reference
};

struct RenderSpec {
  RenderMethod method = RenderMethod::kPaths;
  int lattice_side = 8;        ///< lattice: points on a side of a cell: 2, 4 or 8
  int bounce_paths = 64;       ///< lattice: paths a pixel that follow bounces in corners
  int samples_per_pixel = 50;  ///< paths: shared by the cells of a pixel, rounded up
  double bounce_share = 0.15;  ///< paths: in (0, 1]: of the samples that follow the first bounce
  int bounces = 1;             ///< indirect bounces; 0 leaves direct light alone
  CameraGeometry camera;
  GridWish grid;
  SensorNoise noise;
};
[[nodiscard]] RenderSpec read_render(const ConfigTable& table);

/// The renderer that the spec asks for. May throw.
[[nodiscard]] std::unique_ptr<Renderer> make_renderer(const RenderSpec& spec,
                                                      std::shared_ptr<TracedTarget> target,
                                                      WorkerPool& pool);

}  // namespace engine
