#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include "engine/core/vec.h"

namespace engine {

/// Half vectors drawn round the normal with a lobe's own distribution, the same for all views.
///
/// Cells of x = 1 - cos gamma, gamma between half vector and normal, each equally likely; the lobe
/// counts as even within a cell. Loop-safe but for the constructor.
class HalfVectorLobe {
 public:
  static constexpr int kCells = 512;

  HalfVectorLobe() = default;
  /// `lobe` by x in [0, 1]: finite, not negative, and not 0 everywhere.
  explicit HalfVectorLobe(const std::function<double(double)>& lobe);

  /// The half vector for a number in [0, 1] at this azimuth.
  [[nodiscard]] Eigen::Vector3d draw(double u, double azimuth) const noexcept;
  /// One over the density of half vectors, in steradians.
  [[nodiscard]] double inverse_density_sr(double x) const noexcept;

  struct Cell {
    double x = 0;  ///< at its middle
    double width = 0;
  };
  [[nodiscard]] Cell cell(std::size_t i) const noexcept;

 private:
  std::array<float, kCells + 1> edges_{};
};

}  // namespace engine
