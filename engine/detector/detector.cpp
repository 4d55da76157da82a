#include "engine/detector/detector.h"

#include <algorithm>
#include <atomic>

#include "engine/detector/noise_lanes.h"

namespace engine {
namespace {

/// Pixels that a thread takes at a time, in raster order: whole tiles of the noise.
constexpr std::size_t kChunk = 64 * noise_lanes::kTile;

/// Calls work(begin, size) for the chunks of an image of so many pixels.
template <class Work>
void by_chunks(WorkerPool& pool, std::size_t pixels, const Work& work) noexcept {
  const std::size_t chunks = (pixels + kChunk - 1) / kChunk;
  pool.rows(0, static_cast<int>(chunks), [&](int chunk) {
    const std::size_t begin = static_cast<std::size_t>(chunk) * kChunk;
    work(begin, std::min(kChunk, pixels - begin));
  });
}

}  // namespace

DetectorReport Detector::expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed,
                                std::uint64_t frame, ElectronImage& out) const noexcept {
  out.resize(in.width(), in.height());
  noise_lanes::Means means;
  means.e_per_w_m2 = static_cast<float>(spec_.electrons_per_irradiance(exposure));
  means.dark_e = static_cast<float>(spec_.dark_mean_e(exposure));
  means.full_well_e = static_cast<float>(spec_.full_well_e);
  means.brim_e = std::max(means.full_well_e, noise_lanes::kLargestMean);
  std::atomic<int> full_well_px{0};
  std::atomic<int> no_light_px{0};
  by_chunks(pool_, in.pixels().size(), [&](std::size_t begin, std::size_t size) {
    const noise_lanes::Counts counts =
        noise_lanes::expose({seed, frame, static_cast<std::uint32_t>(begin)}, means,
                            in.pixels().subspan(begin, size), out.pixels().subspan(begin, size));
    // Relaxed: the pool's end of work orders them.
    full_well_px.fetch_add(counts.full_well_px, std::memory_order_relaxed);
    no_light_px.fetch_add(counts.no_light_px, std::memory_order_relaxed);
  });
  return {full_well_px, no_light_px};
}

void Detector::digitize(const ElectronImage& in, std::uint64_t seed, std::uint64_t frame,
                        DnImage& out) const noexcept {
  out.resize(in.width(), in.height());
  noise_lanes::ReadOut read_out;
  read_out.noise_e = static_cast<float>(spec_.read_noise_e);
  read_out.dn_per_e = static_cast<float>(1.0 / spec_.gain_e_dn());
  read_out.offset_dn =
      static_cast<float>(spec_.pedestal_dn + (spec_.quantiser == Quantiser::kRound ? 0.5 : 0.0));
  read_out.largest_dn = static_cast<float>(spec_.largest_dn());
  by_chunks(pool_, in.pixels().size(), [&](std::size_t begin, std::size_t size) {
    noise_lanes::digitize({seed, frame, static_cast<std::uint32_t>(begin)}, read_out,
                          in.pixels().subspan(begin, size), out.pixels().subspan(begin, size));
  });
}

}  // namespace engine
