#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "tools/characterize/line_fit.h"

namespace characterize {

/// Which pixels count: 1, or 0 for a defect; in raster order.
using PixelMask = std::vector<std::uint8_t>;

/// Frames of one scene and exposure: what stays is the sensor's pattern, what changes is noise.
///
/// EMVA 1288 release 4: temporal variance is half that of the difference of two frames (section
/// 6.3), so that no pattern enters; spatial variance is that of the mean image less what of the
/// temporal is left in it (section 8). Frames count in pairs.
class ImageStack {
 public:
  /// Of an image of `mask`'s pixels.
  explicit ImageStack(PixelMask mask);

  /// Pre: of the mask's size; 60 000 frames at most.
  void add(const engine::DnImage& frame);

  [[nodiscard]] int frames() const noexcept { return frames_; }
  [[nodiscard]] std::size_t pixels() const noexcept { return used_; }
  /// Of the frames' mean values. The error is that of the temporal noise: the pattern is the same
  /// in all frames.
  [[nodiscard]] Quantity mean_dn() const;
  /// Pre: two frames at least.
  [[nodiscard]] Quantity temporal_variance_dn2() const;
  /// May be negative where there is no pattern. The error is of these pixels' pattern, not of what
  /// other sensors of the kind have. Pre: two frames at least.
  [[nodiscard]] Quantity spatial_variance_dn2() const;
  /// Of all values, the share that are 0 DN.
  [[nodiscard]] double share_at_zero() const noexcept;

  /// Mean of each pixel over the frames.
  [[nodiscard]] std::vector<float> mean_image_dn() const;

 private:
  PixelMask mask_;
  std::size_t used_ = 0;
  int frames_ = 0;
  std::vector<std::uint32_t> sum_;
  std::vector<std::uint16_t> first_;  ///< of the pair in hand
  std::uint64_t zeros_ = 0;
  double difference_variances_ = 0;  ///< sum over pairs
};

/// Pixels of a mean image further than `sigmas` from the median; sigma is what the median absolute
/// deviation says, and not less than `least_sigma_dn`.
[[nodiscard]] std::vector<std::size_t> outliers(std::span<const float> mean_dn, double sigmas,
                                                double least_sigma_dn);

}  // namespace characterize
