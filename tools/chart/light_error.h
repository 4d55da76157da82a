#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/detector/detector_spec.h"
#include "engine/scene_generator.h"

namespace chart {

/// Frames of one instant, in electrons and free of noise: their mean and how they scatter. What is
/// over the full well counts as full.
class LightStack {
 public:
  LightStack(int width, int height, double full_well_e);

  void add(const engine::IrradianceImage& light, double e_per_irradiance);
  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] int frames() const noexcept { return frames_; }
  [[nodiscard]] double mean_e(std::size_t i) const noexcept { return mean_e_[i]; }
  /// Of one frame; 0 for a single one.
  [[nodiscard]] double variance_e2(std::size_t i) const noexcept {
    return frames_ > 1 ? squares_e2_[i] / (frames_ - 1) : 0.0;
  }
  [[nodiscard]] bool clipped(std::size_t i) const noexcept { return mean_e_[i] >= full_well_e_; }

 private:
  int width_;
  int height_;
  double full_well_e_;
  int frames_ = 0;
  std::vector<double> mean_e_;
  std::vector<double> squares_e2_;  ///< of the differences from the mean
};

/// Which pixels are looked at apart.
enum class PixelClass : std::uint8_t {
  kElsewhere,  ///< further than 32 px from the target's light
  kSky,        ///< no light of the target, but near it; all of a frame without any
  kLit,        ///< the target's light is above one sigma of the background's noise: truth's mask
  kEdge        ///< of these, where the next pixel differs by more than five sigma of the noise
};

/// rms over a class of pixels, each pixel's error over its noise in the camera.
struct ClassError {
  int px = 0;
  double rho = std::numeric_limits<double>::quiet_NaN();        ///< of one frame: bias and scatter
  double bias = std::numeric_limits<double>::quiet_NaN();       ///< what stays in the mean of many
  double noise = std::numeric_limits<double>::quiet_NaN();      ///< what does not
  double reference = std::numeric_limits<double>::quiet_NaN();  ///< the reference's own noise
};

/// How far frames are from a reference. Not a number where there is nothing to tell by.
struct LightError {
  ClassError lit;  ///< edges included
  ClassError edge;
  ClassError sky;
  double flux_share = std::numeric_limits<double>::quiet_NaN();   ///< too much is positive
  double centroid_px = std::numeric_limits<double>::quiet_NaN();  ///< of the target's light
};

/// Sorts pixels by a reference, which outlives it, and its mask.
class PixelSorter {
 public:
  PixelSorter(const LightStack& reference, const engine::TruthMask& mask,
              const engine::DetectorSpec& detector, engine::Duration exposure);

  [[nodiscard]] std::span<const PixelClass> classes() const noexcept { return classes_; }
  /// Variances of noise are taken off the square of the difference of two means: so a bias far
  /// below the noise of the mean reads as some share of that, or as 0.
  [[nodiscard]] LightError compare(const LightStack& frames) const;

 private:
  [[nodiscard]] double noise_e(std::size_t i) const noexcept;
  [[nodiscard]] ClassError compare(const LightStack& frames, bool (*wanted)(PixelClass)) const;

  const LightStack& reference_;
  engine::DetectorSpec detector_;
  double dark_e_;
  std::vector<PixelClass> classes_;
};

}  // namespace chart
