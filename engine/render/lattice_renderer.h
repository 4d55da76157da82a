#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "engine/render/path_tracer.h"
#include "engine/render/render_spec.h"
#include "engine/render/triangle_raster.h"

namespace engine {

/// What a lattice of points on the detector sees, and the light that falls there.
///
/// The camera and the lamps are far: a facet's direct light is one number a frame (Facets), and
/// what is left of a cell is which share of it each facet covers and which of that is in the light.
/// The shares come from a z-buffer of 16 or 64 points a cell, at a tenth of what rays cost. Whether
/// a lamp reaches a point is asked by rays, at one point in four of each facet in a cell; at all of
/// them where the cells beside it are partly in shadow, so that edges of shadows are as fine as
/// those of the target. That is decided by other cells' points: a cell's own could not decide
/// without bias. Bounces are paths from few of the points (BouncedLight).
/// The lattice is the same in each frame: what it gets wrong, below 1/64 of a cell on an edge,
/// shows as no noise.
///
/// A view that the lattice does not fit, with a part of the target behind the camera or nearer than
/// its own size, is the path tracer's.
/// Leaves out: the Sun's disc, and light that took more than `bounces` bounces.
/// Thread: loop. Loop-safe but for the constructor.
class LatticeRenderer final : public Renderer {
 public:
  LatticeRenderer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool);

  /// A budget of up to 16 points a cell takes the coarse lattice.
  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  /// A facet in a cell.
  struct Share {
    std::uint32_t facet = 0;
    std::uint16_t first_point = 0;  // in the cell, row by row
    std::uint16_t points = 0;
    std::uint16_t asked = 0;                     // of these, whether they are in the light
    std::array<std::uint16_t, kLamps> hidden{};  // of the asked, from each lamp
    bool asks_at_first_point = false;            // which is not one of those that ask first
  };
  struct Cell {
    int points = 0;  // on the target
    std::uint32_t first_share = 0;
    std::uint32_t end_share = 0;
    bool fine = false;  // all of its points are asked
  };
  /// Rays to a lamp, until they are a packet.
  struct ShadowQueue {
    RayPacket rays;
    std::array<std::uint32_t, RayPacket::kLanes> share{};
    int used = 0;
  };
  /// What a thread needs for a row of pixels.
  struct Bench {
    std::vector<std::uint32_t> seen;  // by the row's points, as TriangleRaster gives them
    std::vector<float> nearness;
    std::vector<Share> shares;  // of a row of cells
    std::vector<Cell> cells;
    std::array<ShadowQueue, kLamps> queues;
    std::atomic<bool> taken{false};
  };
  struct RowCounts {
    RayCounts rays;
    std::uint64_t hits = 0;
  };
  /// A row of cells in hand.
  struct Strip {
    const Snapshot& snapshot;
    Bench& bench;
    RowCounts& counts;
    int first_point_row;  // in the region
    int first_bench_row;
    int cells;
  };
  /// Camera rays as a linear function of the place on the lattice, begun near the target: in single
  /// precision they are good to micrometres there.
  struct View {
    Eigen::Vector3f start;
    Eigen::Vector3f start_per_x;
    Eigen::Vector3f start_per_y;
    Eigen::Vector3f direction;
    Eigen::Vector3f direction_per_x;
    Eigen::Vector3f direction_per_y;
  };

  [[nodiscard]] bool place(const Snapshot& snapshot, const PixelRect& region, int side) noexcept;
  [[nodiscard]] Bench& take_bench() noexcept;
  void shade_pixel_row(const Snapshot& snapshot, Radiance& out, int row) noexcept;
  void collect(const Strip& strip, int cell) const noexcept;
  [[nodiscard]] bool edge_of_shadow_beside(const Strip& strip, int cell) const noexcept;
  void ask_the_rest(const Strip& strip, int cell) const noexcept;
  [[nodiscard]] float direct_light(const Strip& strip, int cell) const noexcept;
  [[nodiscard]] float bounced_light(const Strip& strip, int cell, PixelPoint place) const noexcept;
  [[nodiscard]] std::uint32_t seen(const Strip& strip, int i, int y) const noexcept;
  [[nodiscard]] SurfacePoint point_at(std::uint32_t facet, int i, int j,
                                      Eigen::Vector3f& direction) const noexcept;
  void ask(const Strip& strip, std::size_t share, int i, int y) const noexcept;
  void send(const Strip& strip, std::size_t lamp) const noexcept;

  RenderSpec spec_;
  std::shared_ptr<TracedTarget> target_;
  BouncedLight bounced_;
  PathTracer paths_;
  Footprint footprint_;
  TriangleRaster raster_;
  WorkerPool& pool_;
  std::vector<TriangleRaster::Corner> corners_;
  std::vector<std::unique_ptr<Bench>> benches_;  ///< one a thread
  std::vector<RowCounts> row_counts_;            ///< by row of pixels
  // Of the frame in hand.
  View view_;
  int side_ = 0;
  std::array<Eigen::Vector3f, kLamps> toward_lamp_;
};

}  // namespace engine
