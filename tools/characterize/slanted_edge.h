#pragma once

#include <vector>

#include "engine/core/image.h"

namespace characterize {

/// Of the spread function: ISO 12233's.
inline constexpr double kEdgeBin_px = 0.25;

/// A part of an image that an edge crosses from top to bottom, a few degrees off its columns: 0 far
/// to one side of it, 1 to the other, which takes a dark and a flat image to make. Pixels that are
/// not a number do not count.
struct EdgeImage {
  int width = 0;
  int height = 0;
  std::vector<float> value;  ///< row by row
  [[nodiscard]] double at(int u, int v) const noexcept {
    return static_cast<double>(value[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                                     static_cast<std::size_t>(u)]);
  }
};

struct EdgeResponse {
  double offset_px = 0;               ///< u of the edge in row 0
  double slope = 0;                   ///< du / dv
  std::vector<double> distance_px;    ///< from the edge, along its normal (1, -slope)
  std::vector<double> spread;         ///< edge spread function, 0 to 1
  std::vector<double> cycles_per_px;  ///< along the normal, 0 to 0.5
  std::vector<double> mtf;
};

/// Spatial frequency response by a slanted edge, ISO 12233: the edge is found in the image, the
/// pixels are binned by their distance to it, a fourth of a pixel each, the spread function is
/// differentiated and transformed; what bins and differences take off is put back.
///
/// We differ in the scale: by 0 and 1 far from the edge, not by the sum of a window, which knows
/// nothing of the wings beyond it. The window, up to `reach_px` to each side, is flat over its
/// inner half and falls as a cosine. Throws std::runtime_error when there is no edge that fits.
[[nodiscard]] EdgeResponse slanted_edge(const EdgeImage& image, double reach_px);

/// The share of each cell of a grid that lies on the far side of a line: exact. Cells of 1/s px,
/// `region` in pixels as in engine::Radiance. The line goes through `on`; `normal` is of unit
/// length and points to the far side.
[[nodiscard]] engine::RadianceImage half_plane(const engine::PixelRect& region, int s,
                                               engine::PixelPoint on, engine::PixelPoint normal,
                                               double far_side);

}  // namespace characterize
