#pragma once

#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/random.h"
#include "engine/core/worker_pool.h"
#include "engine/render/embree_scene.h"
#include "engine/render/facets.h"
#include "engine/render/footprint.h"
#include "engine/render/renderer.h"

namespace engine {

struct RenderSpec {
  int samples_per_pixel = 50;  ///< shared by the cells of a pixel, rounded up
  int bounces = 1;             ///< indirect bounces; 0 leaves direct light alone
  double bounce_share = 0.15;  ///< in (0, 1]: of the samples that follow the first bounce
  CameraGeometry camera;
  GridWish grid;
};
[[nodiscard]] RenderSpec read_render(const ConfigTable& table);

/// Path tracing from the camera, eq 10-12 of Li et al. 2023: the lamps by next-event estimation,
/// bounces by sampling the BRDF.
///
/// Rays run in double up to the target and in single precision only there: from 100 km away single
/// precision costs half a pixel. A sample asks one lamp whether it is hidden, chosen by how much it
/// would give; where both are in the open that adds no noise.
/// We differ from the print: the direct term has its cosine, and bounces are drawn from a mixture
/// that finds every direction light can come from; the 15 deg cone of eq 13-14 loses 43-99 % of it.
/// Light that bounces is taken to leave the surface where the lamp struck it evenly, with the
/// albedo of its direction: the energy is kept, caustics are spread out. Followed exactly they are
/// found by one sample in thousands, and those few move the photocentre of a frame by a pixel.
/// Leaves out: the Sun's disc, and light that took more than `bounces` bounces.
/// Thread: loop. Loop-safe but for the constructor.
class PathTracer final : public Renderer {
 public:
  /// `materials` must name every material of the mesh: ConfigError otherwise.
  PathTracer(const RenderSpec& spec, Mesh mesh, const std::vector<Material>& materials,
             WorkerPool& pool);

  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  struct RowCounts {
    RayCounts rays;
    std::uint64_t samples = 0;
    std::uint64_t hits = 0;
  };
  /// A camera ray as a linear function of the place on the detector.
  struct View {
    Eigen::Vector3d origin;   ///< the camera, in the body frame
    Eigen::Vector3d at_zero;  ///< direction at pixel (0, 0)
    Eigen::Vector3d per_u;    ///< and how it changes
    Eigen::Vector3d per_v;
    double advance = 0;  ///< how many direction lengths to skip before the target
  };

  void trace_pixel_row(const Snapshot& snapshot, const View& view, int samples_per_cell,
                       Radiance& out, int row) noexcept;
  void trace_pixel(const Snapshot& snapshot, const View& view, int samples_per_cell,
                   PixelPoint pixel, Draws draws, std::span<float> cells,
                   RowCounts& counts) const noexcept;
  void shade(const Snapshot& snapshot, const RayPacket& rays, Draws& draws,
             std::array<float, RayPacket::kLanes>& radiance, RowCounts& counts) const noexcept;
  [[nodiscard]] double indirect_light(const Snapshot& snapshot, SurfacePoint from,
                                      Eigen::Vector3d direction, Draws& draws,
                                      RayCounts& counts) const noexcept;
  [[nodiscard]] double scattered_light(const Snapshot& snapshot, const SurfacePoint& at,
                                       Draws& draws, RayCounts& counts) const noexcept;

  RenderSpec spec_;
  Mesh mesh_;
  double bounding_radius_m_;
  EmbreeScene scene_;
  Facets facets_;
  Footprint footprint_;
  WorkerPool& pool_;
  std::vector<RowCounts> row_counts_;  ///< by row of pixels
};

}  // namespace engine
