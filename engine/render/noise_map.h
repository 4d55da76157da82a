#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/render/renderer.h"

namespace engine {

/// What the Monte Carlo noise of a rendered image is worth on the sensor, and how many samples
/// would bring it down to a limit.
///
/// Maps are of mean radiance over pixels, row by row over a region, as the light arrives; the
/// optics then spread light and average noise: the variance of a pixel is the sum of h_j^2 var_j
/// over its neighbours, h a Gaussian of SensorNoise::blur_px. Noise is judged in the sensor's own
/// sigma of the pixel's mean. A pixel is lit when its mean is above one sigma of a dark pixel; one
/// whose mean is at full well is counted apart: its noise is clipped.
/// Leaves out: light spread from outside the region, and noise that neighbours have in common.
/// Thread: loop. Loop-safe but for the constructor.
class NoiseMap {
 public:
  /// No region is larger than `largest`.
  NoiseMap(const PixelRect& largest, const SensorNoise& noise);

  /// Of pixels of these means and variances of their means, both in W/m^2/sr (squared). Not a
  /// number where the sensor is not known.
  [[nodiscard]] NoiseReached measure(const PixelRect& region, std::span<const float> mean,
                                     std::span<const float> variance) noexcept;

  /// What is left after the optics of the variance of a pixel whose neighbours have as much.
  [[nodiscard]] double kept_variance() const noexcept { return squares_; }

  struct Plan {
    double limit = 0;  ///< of the noise after the optics over the sensor's, rms over lit pixels
    int least = 1;     ///< samples a pixel
    int most = 1;
  };
  /// How many samples each pixel should get so that the limit is met with the fewest of all: as the
  /// root of the variance of one sample, averaged over its neighbours, times what it weighs after
  /// the optics (Neyman 1934). From a pilot that nothing else may be taken from: samples chosen by
  /// what they showed would be biased.
  void plan(const Plan& wish, const PixelRect& region, std::span<const float> mean,
            std::span<const float> variance_of_one, std::span<std::uint32_t> samples) noexcept;

 private:
  using Map = std::vector<float>;
  struct Kernel {
    static constexpr int kReach = 16;
    /// Of a Gaussian of this rms, as shares of the whole that fall on pixels 0, 1, ... away.
    explicit Kernel(double rms_px);
    std::vector<float> weight;
  };
  /// out = in, spread by the kernel in both directions; may be the same map.
  void spread(const Kernel& kernel, const PixelRect& region, const Map& in, Map& out) noexcept;
  /// signal_ and 1 / sigma^2 of lit pixels, 0 of others.
  [[nodiscard]] NoiseReached judge(const PixelRect& region, std::span<const float> mean) noexcept;

  SensorNoise noise_;
  Kernel light_;
  Kernel noise_kernel_;
  double squares_ = 1;  ///< sum of h^2
  Kernel neighbours_;
  Map signal_;
  Map weight_;
  Map work_;
  Map lines_;
};

}  // namespace engine
