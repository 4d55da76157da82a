#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "engine/render/noise_map.h"

namespace engine {

/// What the error of a lattice's picture is worth on the sensor.
///
/// Two errors look like noise. Of n by n points a pixel, an edge between two radiances leaves the
/// share p of either unsure: its variance is some n^-3 p (1 - p), over edges of all places and
/// directions; for many tones the variance between them stands for p (1 - p). And light that
/// bounces is known from few rays, each cell's for itself. Measured on two telescopes: right to 25
/// % after the optics (where bounces count a texel's noise is an upper bound: up to twice), up
/// to 1.7 times too small before them. Leaves out: what a mirror sees, by a ray a facet and pixel.
/// Thread: set(), of a pixel each, and too_noisy() any; the rest the loop's. Loop-safe but for the
/// constructor.
class LatticeNoise {
 public:
  /// Of a pixel's points, whatever they see.
  struct Tally {
    float squares = 0;   ///< sum of squared radiances, in (W/m^2/sr)^2
    float variance = 0;  ///< of the pixel's mean, from noise of its parts
  };

  /// No region is larger than `largest`.
  LatticeNoise(const PixelRect& largest, const SensorNoise& noise);

  /// `limit`: in the sensor's sigmas, see too_noisy().
  void start(const PixelRect& region, int points_a_pixel_side, double limit) noexcept;
  /// Whether independent parts of a pixel, so many, would have more than the limit if all of them
  /// had this noise (rms) and light.
  [[nodiscard]] bool too_noisy(float noise_w_m2_sr, float light_w_m2_sr,
                               float parts) const noexcept {
    return noise_w_m2_sr * noise_w_m2_sr > parts * (limit_dark_ + limit_lit_ * light_w_m2_sr);
  }
  /// Cells of `parts` a pixel with the same noise: how many times their variance is worth that of
  /// noise of their own, which the optics average over.
  [[nodiscard]] float alike(float cells, int parts) const noexcept {
    return std::clamp(cells, 1.0F, static_cast<float>(parts) / kept_);
  }
  /// Pixel `index` of the region, row by row, has this mean.
  void set(std::size_t index, float mean_w_m2_sr, const Tally& tally) noexcept;
  [[nodiscard]] NoiseReached reached() noexcept;

 private:
  NoiseMap map_;
  SensorNoise noise_;
  PixelRect region_;
  float kept_ = 1;  ///< of a pixel's variance, by the optics
  float points_ = 1;
  float edge_share_ = 0;  ///< of the variance between tones
  // Variance of a pixel that is at the limit: at no light, and more for each W/m^2/sr.
  float limit_dark_ = 0;
  float limit_lit_ = 0;
  std::vector<float> mean_;
  std::vector<float> variance_;
};

}  // namespace engine
