#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/render/lattice_view.h"

namespace engine {

/// The facets that a pixel of a lattice sees, and where the points of each lie.
/// Thread: one at a time. Loop-safe but for the constructor. The view outlives it.
class PixelTones {
 public:
  static constexpr std::size_t kMostCells = 16;
  /// A facet in a pixel.
  struct Tone {
    std::uint32_t facet = 0;
    std::uint32_t points = 0;
    std::array<std::uint16_t, kMostCells> in_cell{};  ///< points
    // Of these, in half steps from the pixel's corner.
    std::array<std::uint16_t, kMostCells> sum_x{};
    std::array<std::uint16_t, kMostCells> sum_y{};
  };

  explicit PixelTones(const LatticeView& view);

  /// Of pixel `column` of a row that the view saw. Good until the next call.
  [[nodiscard]] std::span<const Tone> find(std::span<const std::uint32_t> seen,
                                           int column) noexcept;

 private:
  [[nodiscard]] bool all_see(std::uint32_t facet) const noexcept;
  [[nodiscard]] Tone whole_pixel(std::uint32_t facet) const noexcept;
  void collect() noexcept;
  void add_run(std::size_t& last, std::uint32_t facet, int x, int y, int length) noexcept;

  const LatticeView& view_;
  std::span<const std::uint32_t> seen_;  ///< of the pixel, row by row with the view's stride
  std::vector<Tone> tones_;
};

}  // namespace engine
