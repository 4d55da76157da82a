#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/optics_spec.h"

namespace engine {

/// What a lens does to light by where in the field it is: vignetting, and stray light.
/// Thread: any. Loop-safe but for the constructor.
class FieldShading {
 public:
  explicit FieldShading(const OpticsSpec& spec);

  [[nodiscard]] bool vignettes() const noexcept { return !shares_.empty(); }
  /// Of an even field's light, at a place in the frame; the nearest's beyond. 1 without vignetting.
  [[nodiscard]] double at(PixelPoint place) const noexcept;
  /// Multiplies a row of the frame.
  void vignette(int v, std::span<float> row) const noexcept;
  void vignette(IrradianceImage& image, WorkerPool& pool) const noexcept;
  /// Spreads veiling_glare of all the light evenly over the frame, whose light stays as much as it
  /// was. Returns how much a pixel has of it, in W/m^2. Leaves out: glare of what is beside the
  /// frame.
  double veil(IrradianceImage& image, WorkerPool& pool) noexcept;

 private:
  int width_px_;
  int height_px_;
  double glare_;
  std::vector<float> shares_;  ///< of each pixel; empty: 1
  std::vector<double> sums_;   ///< of rows
};

}  // namespace engine
