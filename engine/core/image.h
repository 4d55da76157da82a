#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/contract.h"

namespace engine {

/// What a pixel measures. The type of an image says it, so that no stage takes the wrong plane.
struct RadianceQuantity {
  using Value = float;  ///< W/m^2/sr, in band
};
struct CoverQuantity {
  using Value = float;  ///< share of the area that the target covers, in [0, 1]
};
struct IrradianceQuantity {
  using Value = float;  ///< W/m^2 on the detector, mean over the pixel's area
};
struct ElectronQuantity {
  using Value = float;  ///< electrons collected in a pixel
};
struct DnQuantity {
  using Value = std::uint16_t;  ///< digital numbers
};

/// Rows of pixels; pixel (0, 0) is at the upper left, its centre at (0, 0).
/// `resize` never allocates while the area stays within the largest one asked for so far.
template <class Quantity>
class Image {
 public:
  using Value = typename Quantity::Value;

  Image() = default;
  Image(int width, int height) { resize(width, height); }

  void resize(int width, int height) {
    ENSURE(width >= 0 && height >= 0);
    width_ = width;
    height_ = height;
    pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  void reserve(int width, int height) {
    pixels_.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] std::span<Value> pixels() noexcept { return pixels_; }
  [[nodiscard]] std::span<const Value> pixels() const noexcept { return pixels_; }
  [[nodiscard]] std::span<Value> row(int v) noexcept {
    return pixels().subspan(index(0, v), static_cast<std::size_t>(width_));
  }
  [[nodiscard]] std::span<const Value> row(int v) const noexcept {
    return pixels().subspan(index(0, v), static_cast<std::size_t>(width_));
  }
  [[nodiscard]] Value& at(int u, int v) noexcept { return pixels_[index(u, v)]; }
  [[nodiscard]] const Value& at(int u, int v) const noexcept { return pixels_[index(u, v)]; }

 private:
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(u);
  }

  int width_ = 0;
  int height_ = 0;
  std::vector<Value> pixels_;
};

using RadianceImage = Image<RadianceQuantity>;
using CoverImage = Image<CoverQuantity>;
using IrradianceImage = Image<IrradianceQuantity>;
using ElectronImage = Image<ElectronQuantity>;
using DnImage = Image<DnQuantity>;

/// A rectangle of whole pixels: columns [left, right), rows [top, bottom).
struct PixelRect {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;

  [[nodiscard]] int width() const noexcept { return right - left; }
  [[nodiscard]] int height() const noexcept { return bottom - top; }
  [[nodiscard]] bool empty() const noexcept { return right <= left || bottom <= top; }
  [[nodiscard]] PixelRect grown_by(int margin) const noexcept {
    return {left - margin, top - margin, right + margin, bottom + margin};
  }
  [[nodiscard]] PixelRect clipped_to(const PixelRect& other) const noexcept {
    return {left > other.left ? left : other.left, top > other.top ? top : other.top,
            right < other.right ? right : other.right,
            bottom < other.bottom ? bottom : other.bottom};
  }
  /// The smallest that holds both.
  [[nodiscard]] PixelRect joined_with(const PixelRect& other) const noexcept {
    if (empty()) return other;
    if (other.empty()) return *this;
    return {std::min(left, other.left), std::min(top, other.top), std::max(right, other.right),
            std::max(bottom, other.bottom)};
  }
};

/// A place on the detector in pixels; pixel (0, 0) has its centre at (0, 0).
struct PixelPoint {
  double u = 0;
  double v = 0;
};

}  // namespace engine
