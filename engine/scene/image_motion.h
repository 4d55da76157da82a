#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/image.h"

namespace engine {

/// How far an image is off an even motion along a line, at even steps of an exposure; at
/// mid-exposure it is not.
struct ImagePath {
  static constexpr int kSteps = 16;
  std::array<PixelPoint, kSteps + 1> off_px{};
  bool bends = false;  ///< unless, nobody sees that the motion is not even
};

/// How an image moves over an exposure.
struct ImageMotion {
  PixelPoint even_px;  ///< from shutter open to shutter close, path apart
  ImagePath path;

  /// From where it is at mid-exposure to where it is after a step.
  [[nodiscard]] PixelPoint after(int step) const noexcept {
    const double t = static_cast<double>(step) / ImagePath::kSteps - 0.5;
    const PixelPoint& off = path.off_px[static_cast<std::size_t>(step)];
    return {t * even_px.u + off.u, t * even_px.v + off.v};
  }
  /// The furthest it is from there, along each axis.
  [[nodiscard]] PixelPoint reach_px() const noexcept {
    PixelPoint most{0.5 * std::abs(even_px.u), 0.5 * std::abs(even_px.v)};
    for (int i = 0; path.bends && i <= ImagePath::kSteps; ++i)
      most = {std::max(most.u, std::abs(after(i).u)), std::max(most.v, std::abs(after(i).v))};
    return most;
  }
  /// Of a step, as an even motion, and where its middle is.
  [[nodiscard]] PixelPoint step_px(int step) const noexcept {
    return {after(step + 1).u - after(step).u, after(step + 1).v - after(step).v};
  }
  [[nodiscard]] PixelPoint middle_of(int step) const noexcept {
    return {0.5 * (after(step + 1).u + after(step).u), 0.5 * (after(step + 1).v + after(step).v)};
  }
};

}  // namespace engine
