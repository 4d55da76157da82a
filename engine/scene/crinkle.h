#pragma once

#include <cstdint>

#include "engine/scene/mesh.h"

namespace engine {

/// The creases of a foil as geometry: a height over the smooth surface, along its normal.
struct CrinkleSpec {
  double height_m = 0;  ///< rms
  double length_m = 1;  ///< from one fold to the next, > 0
  std::uint64_t seed = 1;

  /// Of the surface against the smooth one, rms in each direction, in radians where it is small:
  /// what Brdf's `wrinkle_rad` is of a foil that is smooth here. The same folds must not count
  /// twice: of `w` in all the material has the root of w^2 less this squared.
  [[nodiscard]] double slope() const noexcept { return kSlope * height_m / length_m; }
  /// Measured on 100 000 places: a property of the noise.
  static constexpr double kSlope = 4.54;
};

/// Moves each vertex along its normal, by noise that is a function of its place: bit for bit the
/// same each time. A closed mesh stays closed. Edges should be a third of the length or shorter: of
/// a coarser mesh less height and less slope is left.
///
/// The noise is by gradients on a lattice (Perlin 2002, "Improving noise",
/// DOI 10.1145/566654.566636), its value turned into folds by taking its distance from zero.
void crinkle(Mesh& mesh, const CrinkleSpec& spec);

}  // namespace engine
