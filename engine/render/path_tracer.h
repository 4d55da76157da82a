#pragma once

#include <memory>
#include <vector>

#include "engine/core/random.h"
#include "engine/core/worker_pool.h"
#include "engine/render/bounced_light.h"
#include "engine/render/footprint.h"
#include "engine/render/render_spec.h"
#include "engine/render/renderer.h"
#include "engine/render/traced_target.h"

namespace engine {

/// Path tracing from the camera, eq 10-12 of Li et al. 2023: the lamps by next-event estimation,
/// bounces by sampling the BRDF.
///
/// Rays run in double up to the target and in single precision only there: from 100 km away single
/// precision costs half a pixel. A sample asks one lamp whether it is hidden, chosen by how much it
/// would give; where both are in the open that adds no noise.
/// We differ from the print: the direct term has its cosine, and bounces are BouncedLight's.
/// Leaves out: the Sun's disc, and light that took more than `bounces` bounces.
/// Thread: loop. Loop-safe but for the constructor.
class PathTracer final : public Renderer {
 public:
  PathTracer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool);

  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  struct RowCounts {
    RayCounts rays;
    std::uint64_t samples = 0;
    std::uint64_t hits = 0;
  };
  /// What a packet of camera rays found.
  struct Seen {
    std::array<float, RayPacket::kLanes> radiance{};
    std::array<bool, RayPacket::kLanes> target{};
  };
  /// Means over each of a pixel's cells, row by row.
  struct Cells {
    static constexpr std::size_t kMost = 64;
    std::array<float, kMost> radiance{};
    std::array<float, kMost> cover{};
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
                   PixelPoint pixel, Draws draws, Cells& cells, RowCounts& counts) const noexcept;
  [[nodiscard]] Seen shade(const Snapshot& snapshot, const RayPacket& rays, Draws& draws,
                           RowCounts& counts) const noexcept;

  RenderSpec spec_;
  std::shared_ptr<TracedTarget> target_;
  BouncedLight bounced_;
  Footprint footprint_;
  WorkerPool& pool_;
  std::vector<RowCounts> row_counts_;  ///< by row of pixels
};

}  // namespace engine
