#pragma once

#include <vector>

#include "engine/render/bounced_light.h"
#include "engine/render/renderer.h"
#include "engine/render/sample_lanes.h"
#include "engine/render/traced_bodies.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

/// What is the same for all pixels of a frame that see a body, in its axes.
struct TracedFrame {
  TracedFrame() = default;
  TracedFrame(const BodyView& view, const CameraGeometry& camera, double bounding_radius_m,
              double sun_radius_rad) noexcept;

  LampCones lamps;
  Eigen::Vector3d origin;   ///< the camera, in the body frame
  Eigen::Vector3d at_zero;  ///< direction at pixel (0, 0)
  Eigen::Vector3d per_u;    ///< and how it changes
  Eigen::Vector3d per_v;
  double advance = 0;  ///< how many direction lengths to skip before the body
  PixelRect seen;      ///< of the pixels where the body can be
};
/// By body.
using TracedFrames = std::array<TracedFrame, TracedBodies::kMost>;

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
  /// `bounced`: one a body. `most_cells` of a pixel, and `most_slots`: cells times replicates.
  RowTracer(const TracedBodies& bodies, std::span<const BouncedLight> bounced, const Rules& rules,
            int most_columns, int most_cells, int most_slots);

  /// `side`: cells on a side of a pixel.
  void begin(const TracedFrames& frames, int columns, int side, int replicates) noexcept;
  /// Samples [first, last) of each cell and replicate. `keys`: one a replicate.
  void trace(int column, PixelPoint pixel, std::span<const std::uint32_t> keys, int first,
             int last) noexcept;
  void finish() noexcept;

  /// Sums over the samples of a cell, W/m^2/sr. After finish().
  [[nodiscard]] double light(int column, int cell, int replicate) const noexcept {
    const double own = targets_light(column, cell, replicate);
    return several() ? own + light_[slot(column, cell, replicate) + companions_slots()] : own;
  }
  [[nodiscard]] std::uint32_t covered(int column, int cell) const noexcept {
    const std::uint32_t own = covered_by_target(column, cell);
    return several() ? own + covered_[cell_of(column, cell) + companions_cells()] : own;
  }
  /// Of this, what comes from the target.
  [[nodiscard]] double targets_light(int column, int cell, int replicate) const noexcept {
    return light_[slot(column, cell, replicate)];
  }
  [[nodiscard]] std::uint32_t covered_by_target(int column, int cell) const noexcept {
    return covered_[cell_of(column, cell)];
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
  /// What waits at a body, in its axes.
  struct Desk {
    std::array<ShadowQueue, kLamps> direct;
    ShadowQueue bounced_shadow;
    std::vector<Waiting> waiting;  // the last come go first
    std::size_t paths = 0;
  };
  /// Rays of the camera, and what they meet of a body.
  struct Look {
    RayPacket rays;
    std::array<MeshHit, kLanes> hits;
  };

  [[nodiscard]] bool several() const noexcept { return bodies_.count() > 1; }
  /// What the target and its parts send and cover; the rest is the companions'.
  [[nodiscard]] bool is_targets(std::size_t body) const noexcept {
    return bodies_.owner(body) == 0;
  }
  /// The target's slots and cells come first, those of all companions after them.
  [[nodiscard]] std::size_t companions_slots() const noexcept { return slot(columns_, 0, 0); }
  [[nodiscard]] std::size_t companions_cells() const noexcept { return cell_of(columns_, 0); }
  [[nodiscard]] std::size_t cell_of(int column, int cell) const noexcept {
    const int number = column * side_ * side_ + cell;
    return static_cast<std::size_t>(number);
  }
  [[nodiscard]] std::size_t slot(int column, int cell, int replicate) const noexcept {
    const int number = (column * side_ * side_ + cell) * replicates_ + replicate;
    return static_cast<std::size_t>(number);
  }
  void aim(const TracedFrame& frame, RayPacket& rays) const noexcept;
  [[nodiscard]] bool may_see(const TracedFrame& frame, std::size_t lane) const noexcept;
  void look_at_all(std::size_t used) noexcept;
  void send_camera_rays() noexcept;
  void take_hits(std::size_t body, const Look& look, std::size_t used) noexcept;
  void light_directly(std::size_t body, const std::array<SurfacePoint, kLanes>& points,
                      const std::array<MeshHit, kLanes>& hits) noexcept;
  void light_by_earth(std::size_t body, const RayPacket& rays,
                      const std::array<SurfacePoint, kLanes>& points,
                      const std::array<MeshHit, kLanes>& hits) noexcept;
  /// Light of a camera's sample that meets this body first.
  [[nodiscard]] std::uint32_t slot_at(std::size_t body, std::size_t lane) const noexcept {
    return camera_.slot[lane] +
           static_cast<std::uint32_t>(is_targets(body) ? std::size_t{0} : companions_slots());
  }
  void ask(std::size_t body, ShadowQueue& queue, RayCoherence coherence, RayCounts& counts,
           const SurfacePoint& from, const Eigen::Vector3f& toward, std::uint32_t slot,
           double light) noexcept;
  void send(std::size_t body, ShadowQueue& queue, RayCoherence coherence,
            RayCounts& counts) noexcept;
  void bounce_all_from(std::size_t least) noexcept;
  void bounce(std::size_t body, std::size_t count) noexcept;

  const TracedBodies& bodies_;
  std::span<const BouncedLight> bounced_;
  Rules rules_;
  const TracedFrames* frames_ = nullptr;
  int columns_ = 0;
  int side_ = 1;
  int replicates_ = 1;
  std::vector<double> light_;           // by slot
  std::vector<std::uint32_t> covered_;  // by cell
  CameraQueue camera_;
  std::vector<Desk> desks_;  // by body
  std::vector<Look> looks_;  // by body
  std::array<RayCounts, 4> counts_{};
  std::uint64_t hits_ = 0;
};

}  // namespace engine
