#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/render/body_light.h"
#include "engine/render/lamp_view.h"
#include "engine/render/texel_grid.h"

namespace engine {

/// What rays from texels meet: sets of 64 rays, one to each of HemisphereBins, fixed to the body,
/// so found once. Which of the places met a lamp lights is asked as often as is wished.
/// 131 072 sets are kept.
/// Thread: of one set one thread; clear() and add() the loop's. Loop-safe but for the constructor.
/// What it is given outlives it.
class TexelRays {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::size_t kRays = HemisphereBins::kBins;
  static constexpr std::size_t kMostSets = std::size_t{1} << 17U;

  struct Set {
    TexelGrid::Texel texel;
    std::uint32_t number = 0;  ///< what chance is drawn by
    std::uint64_t known = 0;   ///< bins whose rays were sent
    std::uint64_t lit = 0;     ///< of the places met
    // By bin: where its ray went, and what it met.
    std::array<std::uint8_t, kRays> fine{};    ///< of HemisphereBins
    std::array<std::uint32_t, kRays> sides{};  ///< 2 * facet + side, or kNone: the sky
    std::array<std::array<std::uint16_t, 2>, kRays> weights{};
    static constexpr std::size_t kStarts = 4;
    std::array<std::array<float, 2>, kStarts> starts{};  ///< places in the texel
    std::uint32_t starts_known = 0;
    float crowding_per_m = 0;  ///< sum over the rays of 1 / distance, of the sky none
  };
  /// Apart from the sets, for it is looked at in each frame.
  struct Progress {
    std::uint8_t sent = 0;
    bool due = false;        ///< gets rays at the next send()
    bool tried = false;      ///< starts have been looked for
    bool startless = false;  ///< and none was found: it never has any rays
    [[nodiscard]] bool done() const noexcept { return sent == kRays || startless; }
  };

  /// `patches`: whose of what is met is kept, or null.
  TexelRays(const TracedTarget& target, const TexelGrid& grid, const SurfacePatches* patches);

  /// Of a texel with this normal, in which its bins lie.
  [[nodiscard]] static Eigen::Matrix3f axes_of(const Eigen::Vector3f& normal) noexcept {
    return basis_round(normal.cast<double>()).cast<float>();
  }

  void clear() noexcept;
  /// Pre: there is room.
  void add(const TexelGrid::Texel& texel, std::uint32_t number) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return sets_.size(); }
  [[nodiscard]] bool full() const noexcept { return sets_.size() == kMostSets; }
  [[nodiscard]] const Set& set(std::size_t k) const noexcept { return sets_[k]; }
  [[nodiscard]] Progress& progress(std::size_t k) noexcept { return progress_[k]; }
  [[nodiscard]] const Progress& progress(std::size_t k) const noexcept { return progress_[k]; }
  /// Harmonic mean of the distances that its rays went; infinite where all see the sky.
  [[nodiscard]] float distance_m(std::size_t k) const noexcept {
    return static_cast<float>(progress_[k].sent) / sets_[k].crowding_per_m;
  }
  /// Pre: there are patches.
  [[nodiscard]] std::uint32_t patch_met(std::size_t k, std::size_t bin) const noexcept {
    return met_[k][bin];
  }

  /// Some rays for the sets that are due or have none, of [first, end), 64 at most; all of them if
  /// `all`. They start at places that the camera sees: parts of a mesh may reach into one another,
  /// and a facet's hidden part sees nothing. Bit i of the result: set first + i has further ones.
  [[nodiscard]] std::uint64_t send(std::size_t first, std::size_t end,
                                   const Position<BodyFrame>& camera, bool all) noexcept;
  /// Of a lamp in a direction: by its view, and by rays where that cannot tell. Of sides that send
  /// nothing on, by 2 * facet + side, it is not asked.
  void ask_lamp(std::size_t k, const LampView& view, const Eigen::Vector3f& toward,
                std::span<const float> sent_by_side) noexcept;

  /// Since the last call.
  [[nodiscard]] RayCounts take_counts() noexcept {
    return {rays_.exchange(0), rejected_.exchange(0)};
  }

 private:
  void find_starts(std::size_t first, std::size_t end, const Eigen::Vector3f& camera) noexcept;
  void follow(const RayPacket& packet,
              std::span<const std::pair<std::size_t, std::size_t>> who) noexcept;
  void count(const RayCounts& counts) noexcept;

  const TracedTarget& target_;
  const TexelGrid& grid_;
  const SurfacePatches* patches_;
  std::vector<Set> sets_;
  std::vector<Progress> progress_;
  std::vector<std::array<std::uint32_t, kRays>> met_;  ///< patches
  std::atomic<std::uint64_t> rays_{0};
  std::atomic<std::uint64_t> rejected_{0};
};

}  // namespace engine
