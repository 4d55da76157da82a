#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "engine/render/body_light.h"
#include "engine/render/lamp_view.h"
#include "engine/render/lattice_noise.h"
#include "engine/render/lattice_view.h"
#include "engine/render/path_tracer.h"
#include "engine/render/pixel_tones.h"
#include "engine/render/render_spec.h"
#include "engine/render/shadow_doubts.h"
#include "engine/render/texel_light.h"

namespace engine {

/// What a lattice of points on the detector sees, and the light that falls there.
///
/// Camera and Sun are far: a facet's direct light is one number a frame (Facets), and what is left
/// of a pixel is which share of it each facet covers and which of that is in the light. The shares
/// come from a z-buffer of 4 to 64 points a cell (LatticeView), at a tenth of what rays cost. Where
/// a lamp's own view cannot tell light from shadow (LampView), rays ask (ShadowDoubts). Light that
/// bounces is kept on the body: the brighter lamp's by texels as fine as a third of a pixel
/// (TexelLight), the other's by patches (BodyLight), and so is what has no texel yet. Texels know
/// which of the sky they see: the Earth's sunlit cap shines on them from there. A target's first
/// frame asks for its texels and is then made once more.
/// The lattice is the same in each frame: what it gets wrong, below 1/64 of a cell on an edge,
/// shows as no noise.
///
/// A view that the lattice does not fit, with a part of the target behind the camera or nearer than
/// its own size, is the path tracer's.
/// Leaves out: the Sun's disc in shadows, not in glints; caustics.
/// Thread: loop. Loop-safe but for the constructor.
class LatticeRenderer final : public Renderer {
 public:
  LatticeRenderer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool);

  /// A budget of samples takes the finest lattice that has no more.
  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  static constexpr std::size_t kMostCells = PixelTones::kMostCells;
  using Tone = PixelTones::Tone;
  /// A pixel on a facet's plane: near enough a parallelogram.
  struct PixelOnFacet {
    Eigen::Vector3f corner;
    Eigen::Vector3f across;  ///< to the pixel's right
    Eigen::Vector3f down;
  };
  struct Mirror {
    int column = 0;  // of the pixel
    std::uint32_t facet = 0;
    float share = 0;
    std::array<std::uint16_t, kMostCells> in_cell{};
  };
  /// Rays that were mirrored, until they are a packet.
  struct Queue {
    RayPacket rays;
    std::array<std::uint32_t, RayPacket::kLanes> who{};  // index of a Mirror
    int used = 0;
  };
  struct RowCounts {
    RayCounts rays;
    std::uint64_t hits = 0;
  };
  /// What each cell's points of a tone send.
  using CellLight = std::array<float, kMostCells>;
  /// What a thread needs for a row of pixels.
  struct Bench {
    Bench(const LatticeView& view, const TracedTarget& target, std::size_t points)
        : tones(view), doubts(view, target, points) {}
    std::vector<std::uint32_t> seen;  // by the row's points, as TriangleRaster gives them
    std::vector<float> nearness;
    PixelTones tones;
    std::vector<LatticeNoise::Tally> tallies;  // by pixel of the row
    ShadowDoubts doubts;
    std::vector<Mirror> mirrors;
    Queue mirror_rays;
    std::uint32_t last_material = 0;
    TexelLight::Light last_texel;  // of that material
    RowCounts counts;
    std::atomic<bool> taken{false};
  };
  /// A row of pixels in hand.
  struct Row {
    const Snapshot& snapshot;
    Radiance& out;
    Bench& bench;
    int index;  // in the region
  };

  [[nodiscard]] Bench& take_bench() noexcept;
  void light_up(const Snapshot& snapshot, BodyLight::Renewal renewal) noexcept;
  void shade_row(const Snapshot& snapshot, Radiance& out, int index) noexcept;
  void shade(const Row& row, int column, const Tone& tone) noexcept;
  void add_kept(const Row& row, int column, const Tone& tone, const SurfacePoint& middle,
                const PixelOnFacet& pixel, CellLight& light) noexcept;
  [[nodiscard]] PixelOnFacet pixel_on(std::uint32_t facet, int column, int row) const noexcept;
  [[nodiscard]] float kept_by_patch(std::size_t lamp, const SurfacePoint& place) const noexcept;
  [[nodiscard]] float without_texel(const Row& row, const SurfacePoint& place) const noexcept;
  void add_lamp(const Row& row, int column, const Tone& tone, std::size_t lamp,
                const PixelOnFacet& pixel, CellLight& light) const noexcept;
  void send_mirror_rays(const Row& row) const noexcept;
  void settle(const Row& row) noexcept;
  void add(const Row& row, int column, std::size_t cell, float points,
           float radiance) const noexcept;
  void tell_noise(const Row& row) noexcept;

  RenderSpec spec_;
  std::shared_ptr<TracedTarget> target_;
  LatticeView view_;
  std::array<LampView, kLamps> lamp_views_;
  BodyLight body_light_;
  TexelLight texels_;  ///< of texel_lamp_
  PathTracer paths_;
  LatticeNoise noise_;
  WorkerPool& pool_;
  std::vector<std::unique_ptr<Bench>> benches_;  ///< one a thread
  std::vector<RowCounts> row_counts_;            ///< by row of pixels
  bool begun_ = false;                           ///< there was a frame with bounces
  std::size_t kept_lamp_ = kLamps;               ///< whose light the texels have
  // Of the frame in hand.
  std::array<Eigen::Vector3f, kLamps> toward_lamp_;
  std::size_t texel_lamp_ = 0;  ///< the brighter one
  int bounces_ = 0;
  bool shadows_by_map_ = false;  ///< no rays for them
  bool cap_ = false;             ///< the Earth's light is its cap's, kept by texels
  float cells_alike_ = 1;        ///< so many see the same texel
};

}  // namespace engine
