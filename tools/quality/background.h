#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/image.h"

namespace quality {

/// Standard deviation and mean of a normal distribution that was rounded to whole DN.
struct Rounded {
  double mean_dn = 0;
  /// Before rounding; none when all are alike. When there are two values alone, the largest that
  /// is probable.
  std::optional<double> sigma_dn;
};
/// From how many have each DN. By a straight line through the quantiles of the cumulative counts:
/// rounding takes nothing from these, so a sigma of a third of a DN is found as well as one of
/// ten, where the moments of rounded values (Sheppard's correction) no longer hold below half a DN.
/// What stands apart, such as stars, does not count.
[[nodiscard]] Rounded fit_rounded_normal(std::span<const std::uint32_t> count_of_dn) noexcept;

/// What a frame's background is like: level and noise, of the darkest tiles among those with the
/// least roughness, if a seventh of the frame has that level. If not (the Earth fills the frame),
/// each tile has a level of its own, as in Bertin & Arnouts 1996, SExtractor, DOI
/// 10.1051/aas:1996164: the median of what it and its neighbours have.
/// Tiles have 32 pixels on a side; 16 in frames of up to 512 x 512.
/// Thread: one. Loop-safe once built for the largest size.
class BackgroundMeter {
 public:
  BackgroundMeter(int largest_width_px, int largest_height_px);
  void measure(const engine::DnImage& frame) noexcept;

  [[nodiscard]] bool even() const noexcept { return even_; }
  [[nodiscard]] double level_dn() const noexcept { return level_dn_; }
  [[nodiscard]] std::optional<double> sigma_dn() const noexcept { return sigma_dn_; }
  /// As software sees it: rounding's twelfth included.
  [[nodiscard]] double variance_dn2() const noexcept;
  [[nodiscard]] int tile_px() const noexcept { return tile_px_; }
  [[nodiscard]] double level_dn(int u, int v) const noexcept {
    return tiles_[tile_at(u, v)].background_dn;
  }

 private:
  struct Tile {
    double level_dn = 0;
    double rough_dn2 = 0;  ///< variance of white noise that would be as rough
    double background_dn = 0;
  };
  [[nodiscard]] std::size_t tile_at(int u, int v) const noexcept {
    return static_cast<std::size_t>(v / tile_px_) * columns_ +
           static_cast<std::size_t>(u / tile_px_);
  }
  [[nodiscard]] Tile tile_of(const engine::DnImage& frame,
                             const engine::PixelRect& box) const noexcept;
  void cut(const engine::DnImage& frame) noexcept;
  void fill_tiles(const engine::DnImage& frame) noexcept;
  void find_quiet() noexcept;
  /// How far the levels of tiles of one background are apart, at most.
  [[nodiscard]] double near_dn() const noexcept;
  void fit_even(const engine::DnImage& frame) noexcept;
  void spread_uneven() noexcept;

  std::vector<Tile> tiles_;
  std::vector<double> sorted_;
  std::vector<std::uint32_t> count_of_dn_;
  int tile_px_ = 32;
  int row_step_ = 1;  // between the rows of a tile that are looked at
  std::size_t columns_ = 0;
  std::size_t rows_ = 0;
  std::size_t used_ = 0;
  bool even_ = true;
  double level_dn_ = 0;
  double rough_dn2_ = 0;       // of the quiet tiles, their median
  double even_limit_dn2_ = 0;  // rougher tiles hold something besides the background
  std::optional<double> sigma_dn_;
};

}  // namespace quality
