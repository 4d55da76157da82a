#include "engine/detector/detector.h"

#include <algorithm>
#include <atomic>

#include "engine/core/contract.h"
#include "engine/detector/blooming.h"
#include "engine/detector/cosmic_rays.h"
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

std::span<const float> part(std::span<const float> map, std::size_t begin, std::size_t size) {
  return map.empty() ? map : map.subspan(begin, size);
}

}  // namespace

DetectorReport Detector::expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed,
                                std::uint64_t frame, ElectronImage& out) const noexcept {
  out.resize(in.width(), in.height());
  const std::size_t pixels = in.pixels().size();
  ENSURE(maps_.response().empty() || maps_.response().size() == pixels);
  ENSURE(maps_.dark_e_s().empty() || maps_.dark_e_s().size() == pixels);
  // What comes after the light settles the wells anew.
  const bool more = spec_.cosmic_rays_cm2_s > 0.0 || spec_.blooming != Blooming::kNone;
  noise_lanes::Means means;
  means.e_per_w_m2 = static_cast<float>(spec_.electrons_per_irradiance(exposure));
  means.dark_e = static_cast<float>(spec_.dark_mean_e(exposure));
  means.exposure_s = static_cast<float>(seconds(exposure));
  means.clip = !more;
  means.full_well_e = static_cast<float>(spec_.full_well_e);
  means.brim_e = std::max(means.full_well_e, noise_lanes::kLargestMean);
  std::atomic<int> full_well_px{0};
  std::atomic<int> no_light_px{0};
  by_chunks(pool_, pixels, [&](std::size_t begin, std::size_t size) {
    noise_lanes::Means here = means;
    here.response = part(maps_.response(), begin, size);
    here.dark_e_s = part(maps_.dark_e_s(), begin, size);
    const noise_lanes::Counts counts =
        noise_lanes::expose({seed, frame, static_cast<std::uint32_t>(begin)}, here,
                            in.pixels().subspan(begin, size), out.pixels().subspan(begin, size));
    // Relaxed: the pool's end of work orders them.
    full_well_px.fetch_add(counts.full_well_px, std::memory_order_relaxed);
    no_light_px.fetch_add(counts.no_light_px, std::memory_order_relaxed);
  });
  DetectorReport report;
  report.full_well_px = full_well_px;
  report.no_light_px = no_light_px;
  if (more) fill_wells(exposure, seed, frame, out, report);
  return report;
}

void Detector::fill_wells(Duration exposure, std::uint64_t seed, std::uint64_t frame,
                          ElectronImage& out, DetectorReport& report) const noexcept {
  if (spec_.cosmic_rays_cm2_s > 0.0)
    report.cosmic_rays = add_cosmic_rays(spec_, exposure, seed, frame, maps_.response(), out);
  const auto full_well_e = static_cast<float>(spec_.full_well_e);
  const bool blooms = spec_.blooming == Blooming::kColumn;
  std::atomic<int> full_well_px{0};
  by_chunks(pool_, out.pixels().size(), [&](std::size_t begin, std::size_t size) {
    int over = 0;
    for (float& e : out.pixels().subspan(begin, size)) {
      over += e > full_well_e ? 1 : 0;
      if (!blooms) e = std::min(e, full_well_e);
    }
    full_well_px.fetch_add(over, std::memory_order_relaxed);
  });
  report.full_well_px = full_well_px;
  if (blooms && full_well_px > 0)
    report.bloomed_away_e = bloom(out, full_well_e, maps_.response(), pool_);
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
