#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/hemisphere_bins.h"
#include "engine/render/recent_turns.h"
#include "engine/render/traced_target.h"

namespace engine {

/// What comes from the Earth's cap to the sides of a target's facets, by bins, kept from frame to
/// frame: of 16 384 sides, the first that are wanted.
///
/// A side is looked at anew when the Earth or the Sun has turned by 8 mrad, or 64 frames have
/// passed: the bins' quarters are 120 mrad wide.
/// Thread: of() any, the rest the loop's. Loop-safe but for the constructor. The target outlives
/// it.
class CapLight {
 public:
  explicit CapLight(const TracedTarget& target);

  /// Of none any more.
  void clear() noexcept;
  /// Of `side`, 2 * facet + side, from the next renew() on.
  void keep(std::uint32_t side) noexcept;
  void renew(std::uint32_t frame, const EarthLight& earth, WorkerPool& pool) noexcept;

  struct Kept {
    HemisphereBins::FineValues w_m2_sr{};
    std::uint32_t side = 0;
    std::uint32_t seen_in = 0;  ///< frame
    bool known = false;
    bool dark = true;
  };
  /// Null: not kept, or no Earth was there.
  [[nodiscard]] const Kept* of(std::uint32_t side) const noexcept {
    const std::uint32_t slot = slot_of_[side];
    return slot < kept_.size() && kept_[slot].known ? &kept_[slot] : nullptr;
  }

 private:
  void look(Kept& kept, const EarthLight& earth) const noexcept;

  const TracedTarget& target_;
  std::vector<std::uint32_t> slot_of_;  ///< by side
  std::vector<Kept> kept_;
  RecentTurns earth_;
  RecentTurns sun_;
};

}  // namespace engine
