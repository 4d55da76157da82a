#pragma once

#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/mesh.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// The pixels where the target can be: no ray is spent anywhere else.
///
/// Every triangle marks the pixels of its own bounding box on the detector. Conservative: a pixel
/// that sees the target is always marked.
/// Loop-safe: sized in the constructor.
class Footprint {
 public:
  Footprint(const CameraGeometry& camera, int beyond_frame_px, std::size_t vertices);

  void project(const Mesh& mesh, const Snapshot& snapshot) noexcept;

  /// Of the area that all triangles have on the detector's plane, the share that lies in the frame;
  /// 0 when there is no area. A triangle with a corner behind the camera counts for none.
  [[nodiscard]] double visible_fraction() const noexcept { return visible_fraction_; }

  /// Of the marked pixels; empty when the target is out of sight.
  [[nodiscard]] PixelRect region() const noexcept { return region_; }
  /// Pre: the pixel lies in region().
  [[nodiscard]] bool marked(int u, int v) const noexcept {
    return mask_[static_cast<std::size_t>(v - limits_.top) *
                     static_cast<std::size_t>(limits_.width()) +
                 static_cast<std::size_t>(u - limits_.left)] != 0;
  }

 private:
  void mark(const PixelRect& box) noexcept;
  [[nodiscard]] PixelRect box_round(const Mesh::Triangle& triangle) const noexcept;
  void clear() noexcept;
  void measure_visible(const Mesh& mesh) noexcept;

  CameraGeometry camera_;
  PixelRect limits_;
  PixelRect region_;
  double visible_fraction_ = 0;
  std::vector<std::uint8_t> mask_;
  std::vector<PixelPoint> corners_;
};

}  // namespace engine
