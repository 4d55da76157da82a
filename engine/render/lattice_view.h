#pragma once

#include <span>
#include <vector>

#include "engine/render/footprint.h"
#include "engine/render/render_spec.h"
#include "engine/render/traced_target.h"
#include "engine/render/triangle_raster.h"

namespace engine {

/// The camera's view of the target on a lattice of `side` by `side` points a grid cell.
/// Thread: place() the loop's, the rest any. Loop-safe but for the constructor.
class LatticeView {
 public:
  LatticeView(const RenderSpec& spec, std::shared_ptr<const TracedTarget> target);

  /// With so many points on the side of a cell; 0: 4, or more where the target is under 800 points
  /// across, or 2 where it is over 5400. Fewer where there are more than `most` in a pixel, but for
  /// the last 2 by 2; most = 0 allows any number. False: the view does not fit, see
  /// LatticeRenderer.
  [[nodiscard]] bool place(const Snapshot& snapshot, int side, int most) noexcept;
  /// Of each buffer of see(), at most.
  [[nodiscard]] static std::size_t most_points(const RenderSpec& spec) noexcept;

  [[nodiscard]] const Footprint& footprint() const noexcept { return footprint_; }
  [[nodiscard]] PixelRect region() const noexcept { return footprint_.region(); }
  [[nodiscard]] int side() const noexcept { return side_; }
  /// Points on the side of a pixel.
  [[nodiscard]] int points_a_pixel() const noexcept { return points_a_pixel_; }
  /// Of a row of the buffers.
  [[nodiscard]] std::size_t stride() const noexcept { return raster_.stride(); }
  /// Both buffers hold points_a_pixel() * stride() values.
  void see(int pixel_row, std::span<std::uint32_t> seen, std::span<float> nearness) const noexcept {
    raster_.see(pixel_row, seen, nearness);
  }
  /// Where the line of sight through (x, y), in steps from the region's corner, meets the plane of
  /// a facet. `direction` is not of unit length.
  [[nodiscard]] SurfacePoint place_on(std::uint32_t facet, float x, float y,
                                      Eigen::Vector3f& direction) const noexcept;

 private:
  [[nodiscard]] int side_of(int wanted, int most) const noexcept;

  CameraGeometry camera_;
  int oversampling_;
  std::shared_ptr<const TracedTarget> target_;
  Footprint footprint_;
  TriangleRaster raster_;
  std::vector<TriangleRaster::Corner> corners_;
  int side_ = 0;
  int points_a_pixel_ = 0;
  // Lines of sight as linear functions of the place on the lattice, begun near the target: in
  // single precision they are good to micrometres there.
  Eigen::Vector3f start_, start_per_x_, start_per_y_;
  Eigen::Vector3f direction_, direction_per_x_, direction_per_y_;
};

}  // namespace engine
