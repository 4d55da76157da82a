#include "engine/render/cap_light.h"

#include <algorithm>

#include "engine/render/texel_rays.h"

namespace engine {
namespace {

constexpr std::size_t kMostSides = 16384;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;
constexpr float kMostTurned_rad = 8e-3F;
constexpr std::size_t kSidesAShare = 16;

}  // namespace

CapLight::CapLight(const TracedTarget& target)
    : target_(target),
      slot_of_(2 * target.mesh.triangles.size(), kNone),
      earth_(kMostTurned_rad),
      sun_(kMostTurned_rad) {
  kept_.reserve(std::min(slot_of_.size(), kMostSides));
}

void CapLight::clear() noexcept {
  std::ranges::fill(slot_of_, kNone);
  kept_.clear();
}

void CapLight::keep(std::uint32_t side) noexcept {
  if (slot_of_[side] != kNone || kept_.size() == kept_.capacity()) return;
  slot_of_[side] = static_cast<std::uint32_t>(kept_.size());
  kept_.push_back({.w_m2_sr = {}, .side = side});
}

void CapLight::renew(std::uint32_t frame, const EarthLight& earth, WorkerPool& pool) noexcept {
  earth_.note(frame, earth.disc().to_centre.unit.cast<float>());
  sun_.note(frame, earth.disc().to_sun.unit.cast<float>());
  const std::size_t n = kept_.size();
  pool.rows(0, static_cast<int>((n + kSidesAShare - 1) / kSidesAShare), [&](int share) {
    const std::size_t first = static_cast<std::size_t>(share) * kSidesAShare;
    // Some in each frame, not all at once.
    const bool due = (static_cast<std::uint32_t>(share) + frame) % RecentTurns::kFrames == 0;
    for (std::size_t k = first; k < std::min(n, first + kSidesAShare); ++k) {
      Kept& kept = kept_[k];
      if (earth.dark()) {
        kept.known = false;
      } else if (due || !kept.known || earth_.since(kept.seen_in) || sun_.since(kept.seen_in)) {
        look(kept, earth);
        kept.seen_in = frame;
      }
    }
  });
}

void CapLight::look(Kept& kept, const EarthLight& earth) const noexcept {
  const SurfacePoint place = target_.facets.on_side(kept.side / 2, 0, 0, kept.side % 2);
  HemisphereBins::see(earth, TexelRays::axes_of(place.normal), kept.w_m2_sr);
  kept.known = true;
  kept.dark = std::ranges::all_of(kept.w_m2_sr, [](float light) { return !(light > 0.0F); });
}

}  // namespace engine
