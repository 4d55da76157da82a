#pragma once

#include <vector>

#include "engine/render/bounced_light.h"
#include "engine/render/renderer.h"
#include "engine/render/sample_lanes.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

/// What is the same for all pixels of a frame.
struct TracedFrame {
  TracedFrame(const Snapshot& snapshot, const CameraGeometry& camera, double bounding_radius_m,
              double sun_radius_rad) noexcept;

  LampCones lamps;
  Eigen::Vector3d origin;   ///< the camera, in the body frame
  Eigen::Vector3d at_zero;  ///< direction at pixel (0, 0)
  Eigen::Vector3d per_u;    ///< and how it changes
  Eigen::Vector3d per_v;
  double advance = 0;  ///< how many direction lengths to skip before the target
};

/// A row of pixels under way: rays wait here until they are a packet.
///
/// A sample is a place in a cell of a pixel; replicates are samples of the same cells that know
/// nothing of each other. Which of the samples follow a bounce is spread evenly over a pixel. The
/// order of everything is fixed by the row alone.
/// Thread: a worker. Loop-safe but for the constructor.
class RowTracer {
 public:
  static constexpr int kMostSide = 8;

  struct Rules {
    SequenceKind sequence = SequenceKind::kSobol;
    double bounce_share = 1;
  };
  /// `most_cells` of a pixel, and `most_slots`: cells times replicates.
  RowTracer(const TracedTarget& target, const BouncedLight& bounced, const Rules& rules,
            int most_columns, int most_cells, int most_slots);

  /// `side`: cells on a side of a pixel.
  void begin(const TracedFrame& frame, int columns, int side, int replicates) noexcept;
  /// Samples [first, last) of each cell and replicate. `keys`: one a replicate.
  void trace(int column, PixelPoint pixel, std::span<const std::uint32_t> keys, int first,
             int last) noexcept;
  void finish() noexcept;

  /// Sums over the samples of a cell, W/m^2/sr. After finish().
  [[nodiscard]] double light(int column, int cell, int replicate) const noexcept {
    return light_[slot(column, cell, replicate)];
  }
  [[nodiscard]] std::uint32_t covered(int column, int cell) const noexcept {
    return covered_[static_cast<std::size_t>(column * side_ * side_ + cell)];
  }
  [[nodiscard]] const RayCounts& camera_rays() const noexcept { return counts_[0]; }
  [[nodiscard]] const RayCounts& shadow_rays() const noexcept { return counts_[1]; }
  [[nodiscard]] const RayCounts& bounce_rays() const noexcept { return counts_[2]; }
  [[nodiscard]] const RayCounts& bounce_shadow_rays() const noexcept { return counts_[3]; }
  [[nodiscard]] std::uint64_t hits() const noexcept { return hits_; }

 private:
  static constexpr std::size_t kLanes = RayPacket::kLanes;

  /// Samples of the camera, and what they are for.
  struct CameraQueue {
    SampleLanes::Words place_key{};
    SampleLanes::Words place{};  // which of the cell's
    SampleLanes::Numbers cell_u{};
    SampleLanes::Numbers cell_v{};
    SampleLanes::Words slot{};
    SampleLanes::Words cell{};
    SampleLanes::Words key{};
    SampleLanes::Words sample{};                  // of the replicate's, in the pixel
    std::array<std::int32_t, kLanes> bouncing{};  // which of those that bounce; -1: it does not
    PixelPoint corner;  // that cells are counted from: the first one's pixel
    int used = 0;
  };
  struct ShadowQueue {
    RayPacket rays;
    std::array<std::uint32_t, kLanes> slot{};
    std::array<double, kLanes> light{};
    int used = 0;
  };
  struct Waiting {
    BouncedLight::Path path;
    std::uint32_t slot = 0;
  };

  [[nodiscard]] std::size_t slot(int column, int cell, int replicate) const noexcept {
    return static_cast<std::size_t>((column * side_ * side_ + cell) * replicates_ + replicate);
  }
  void aim(RayPacket& rays) noexcept;
  void send_camera_rays() noexcept;
  void light_directly(const std::array<SurfacePoint, kLanes>& points,
                      const std::array<MeshHit, kLanes>& hits) noexcept;
  void light_by_earth(const RayPacket& rays, const std::array<SurfacePoint, kLanes>& points,
                      const std::array<MeshHit, kLanes>& hits) noexcept;
  void ask(ShadowQueue& queue, RayCoherence coherence, RayCounts& counts, const SurfacePoint& from,
           const Eigen::Vector3f& toward, std::uint32_t slot, double light) noexcept;
  void send(ShadowQueue& queue, RayCoherence coherence, RayCounts& counts) noexcept;
  void bounce(std::size_t count) noexcept;

  const TracedTarget& target_;
  const BouncedLight& bounced_;
  Rules rules_;
  const TracedFrame* frame_ = nullptr;
  int columns_ = 0;
  int side_ = 1;
  int replicates_ = 1;
  std::vector<double> light_;           // by slot
  std::vector<std::uint32_t> covered_;  // by cell
  CameraQueue camera_;
  std::array<ShadowQueue, kLamps> direct_;
  ShadowQueue bounced_shadow_;
  std::array<Waiting, 3 * kLanes> waiting_;  // the last come go first
  std::size_t paths_ = 0;
  std::array<RayCounts, 4> counts_{};
  std::uint64_t hits_ = 0;
};

}  // namespace engine
