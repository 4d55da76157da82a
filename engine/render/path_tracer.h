#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/bounced_light.h"
#include "engine/render/footprint.h"
#include "engine/render/noise_map.h"
#include "engine/render/render_spec.h"
#include "engine/render/renderer.h"
#include "engine/render/row_tracer.h"
#include "engine/render/traced_bodies.h"

namespace engine {

/// Path tracing from the camera, eq 10-12 of Li et al. 2023: the lamps by next-event estimation,
/// bounces by sampling the BRDF. The reference for every other renderer, and the one that knows
/// several bodies: they hide, shade and light each other.
///
/// Rays run in double up to the target and in single precision only there: from 100 km away single
/// precision costs half a pixel.
/// Samples: so many in every pixel, or as many as the sensor's noise asks for. Then a pilot of 16 a
/// pixel says where noise is, and the image is made of samples that the pilot knows nothing of
/// (Kirk and Arvo 1991, DOI 10.1145/127719.122735): where the one stops and the other begins adds
/// no bias. Every image is the mean of replicates, from which its own noise is known. With a
/// deadline, samples come in passes, each as many as all before it.
/// We differ from the print: the direct term has its cosine, and bounces are BouncedLight's.
/// Leaves out: light that took more than `bounces` bounces, the darkening of the Sun's limb.
/// Thread: loop. Loop-safe but for the constructor.
class PathTracer final : public Renderer {
 public:
  /// Snapshots must have as many companions and parts.
  PathTracer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool,
             const OtherBodies& others = {});

  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  static constexpr int kPilotReplicates = 4;
  static constexpr int kPilotEach = 4;   ///< samples a replicate
  static constexpr int kReplicates = 2;  ///< of an image; one where a cell has one sample only

  /// A worker's own.
  struct Bench {
    RowTracer tracer;
    std::atomic<bool> taken{false};
    template <class... Arguments>
    explicit Bench(Arguments&&... arguments) : tracer(std::forward<Arguments>(arguments)...) {}
  };
  struct RowCounts {
    RaysByKind rays;
    std::uint64_t rejected = 0;
    std::uint64_t samples = 0;
    std::uint64_t hits = 0;
  };
  /// Samples of each cell and replicate that a pass takes up to, where a pixel has as many.
  struct Pass {
    std::uint32_t from = 0;
    std::uint32_t to = 0;
  };

  void find_bodies(const Snapshot& snapshot, RenderReport& report) noexcept;
  void size_images(Radiance& out) const noexcept;
  void light_up(const Snapshot& snapshot, RenderReport& report) noexcept;
  void choose_samples(const Snapshot& snapshot, const Budget& budget,
                      const PixelRect& region) noexcept;
  void plan_samples(const Snapshot& snapshot, const Budget& budget,
                    const PixelRect& region) noexcept;
  void pilot_row(const Snapshot& snapshot, const PixelRect& region, int row) noexcept;
  /// `start`: when the frame began, by the clock that it is to be ready by.
  void run_passes(const Snapshot& snapshot, const Budget& budget, Duration start, Radiance& out,
                  RenderReport& report) noexcept;
  void trace_row(const Snapshot& snapshot, const Pass& pass, Radiance& out, int row) noexcept;
  void clear_row(Radiance& out, int row) noexcept;
  /// `traced`: the column by the tracer's count.
  void take_pixel(const RowTracer& tracer, const Pass& pass, Radiance& out, int traced, int column,
                  int row) noexcept;
  void take_targets_part(const RowTracer& tracer, const Pass& pass, Radiance& out, int traced,
                         int column, int row) const noexcept;
  [[nodiscard]] bool reads_clock(const Budget& budget) const noexcept;
  [[nodiscard]] std::uint64_t samples_of(const Pass& pass, const PixelRect& region) const noexcept;
  void report_noise(const PixelRect& region, std::uint32_t reached, RenderReport& report) noexcept;
  void count(const RowTracer& tracer, int row) noexcept;
  void count_up(RenderReport& report) const noexcept;
  [[nodiscard]] double sun_radius_for(const Snapshot& snapshot,
                                      RenderReport& report) const noexcept;
  [[nodiscard]] Bench& take_bench() noexcept;
  [[nodiscard]] std::size_t pixel(const PixelRect& region, int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(region.width()) +
           static_cast<std::size_t>(column);
  }

  RenderSpec spec_;
  TracedBodies bodies_;
  std::vector<BouncedLight> bounced_;  ///< by body
  TracedFrames frames_;                ///< by body
  Footprint footprint_;
  NoiseMap noise_;
  WorkerPool& pool_;
  std::vector<std::unique_ptr<Bench>> benches_;  ///< one a thread
  std::vector<RowCounts> row_counts_;            ///< by row of pixels
  int replicates_used_ = kReplicates;
  // By pixel of the region.
  std::vector<std::uint32_t> wanted_;                       ///< of each cell and replicate
  std::vector<std::array<float, kReplicates>> replicates_;  ///< means so far
  std::vector<float> mean_;
  std::vector<float> variance_;
};

}  // namespace engine
