#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/render/traced_target.h"

namespace engine {

/// Both sides of a target's facets cut into texels, numbered through: near squares along a facet's
/// longest edge, of which those beyond the other two stay empty; at least one to a side.
/// Thread: cut() the loop's, the rest any. Loop-safe but for the constructor. The target outlives
/// it.
class TexelGrid {
 public:
  explicit TexelGrid(const TracedTarget& target);

  /// Texels no wider than this, unless there would be too many: how wide they are at most.
  float cut(float texel_m) noexcept;

  [[nodiscard]] std::size_t most_texels() const noexcept { return most_texels_; }
  [[nodiscard]] std::uint32_t texels() const noexcept { return texels_; }
  /// Of a place of a side (0 or 1) of a facet; `second` and `third` are its weights of the facet's
  /// corners, which may lie beyond its edges or be no numbers.
  [[nodiscard]] std::uint32_t at(std::uint32_t facet, unsigned side, float second,
                                 float third) const noexcept {
    const Side& s = sides_[2 * std::size_t{facet} + side];
    const auto [along, up] = frames_[facet].across(second, third);
    return s.first + step(along, s.along) * s.up + step(up, s.up);
  }

  /// A texel by its number.
  struct Texel {
    std::uint32_t facet = 0;
    unsigned side = 0;
    std::array<float, 2> low{};   ///< in the facet's Frame
    std::array<float, 2> span{};  ///< of these
  };
  [[nodiscard]] Texel texel(std::uint32_t number) const noexcept;
  /// Calls `use` with the numbers of all texels of the same side whose middles lie within `reach_m`
  /// of this one's, and no more than four texels away, and their squared distances; its own among
  /// them.
  template <typename Use>
  void each_near(std::uint32_t number, const Texel& texel, float reach_m, Use use) const noexcept;
  /// A place in it; `a` and `b` in [0, 1]. On the facet's edge where the texel reaches beyond.
  [[nodiscard]] SurfacePoint place(const Texel& texel, float a, float b) const noexcept;

 private:
  /// A facet laid on its longest edge: 0 to 1 along it, and 0 to 1 up to the corner above.
  struct Frame {
    std::uint8_t top = 2;  ///< the corner above; the edge runs from the next one to the last
    float foot = 0;        ///< of the top on the edge
    float edge_m = 0;
    float height_m = 0;
    [[nodiscard]] std::array<float, 2> across(float second, float third) const noexcept {
      const std::array<float, 3> weight = {1.0F - second - third, second, third};
      const float up = weight[top];
      return {weight[(top + 2U) % 3U] + foot * up, up};
    }
    /// Weights of the second and the third corner.
    [[nodiscard]] std::array<float, 2> weights(float along, float up) const noexcept;
  };
  static constexpr float kMostNear = 4.0F;  ///< texels
  struct Side {
    std::uint32_t first = 0;
    std::uint16_t along = 1;
    std::uint16_t up = 1;
  };
  [[nodiscard]] static std::uint32_t step(float weight, std::uint16_t steps) noexcept {
    const float x = weight * static_cast<float>(steps);
    // Not a number either.
    if (!(x > 0.0F)) return 0;
    return std::min(static_cast<std::uint32_t>(std::min(x, 65535.0F)), steps - 1U);
  }
  [[nodiscard]] std::uint64_t number_through(float texel_m) noexcept;

  const TracedTarget& target_;
  std::vector<Frame> frames_;  ///< by facet
  std::vector<Side> sides_;    ///< by 2 * facet + side
  std::size_t most_texels_;
  std::uint32_t texels_ = 0;
};

template <typename Use>
void TexelGrid::each_near(std::uint32_t number, const Texel& texel, float reach_m,
                          Use use) const noexcept {
  const Side& s = sides_[2 * std::size_t{texel.facet} + texel.side];
  const float along_m = frames_[texel.facet].edge_m * texel.span[0];
  const float up_m = frames_[texel.facet].height_m * texel.span[1];
  const auto along = static_cast<int>((number - s.first) / s.up);
  const auto up = static_cast<int>((number - s.first) % s.up);
  const auto steps = [](float reach, float step) {
    return reach > 0.0F ? static_cast<int>(std::min(reach / step, kMostNear)) : 0;
  };
  const int wide = steps(reach_m, along_m);
  for (int i = std::max(along - wide, 0); i <= std::min(along + wide, s.along - 1); ++i) {
    const float beside_m = static_cast<float>(i - along) * along_m;
    const int high =
        steps(std::sqrt(std::max(reach_m * reach_m - beside_m * beside_m, 0.0F)), up_m);
    for (int j = std::max(up - high, 0); j <= std::min(up + high, s.up - 1); ++j) {
      const float above_m = static_cast<float>(j - up) * up_m;
      use(s.first + static_cast<std::uint32_t>(i) * s.up + static_cast<std::uint32_t>(j),
          beside_m * beside_m + above_m * above_m);
    }
  }
}

}  // namespace engine
