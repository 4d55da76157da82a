#pragma once

#include <algorithm>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/mesh.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// The pixels where bodies can be: no ray is spent anywhere else.
///
/// Every triangle marks the pixels of its own bounding box on the detector. Conservative: a pixel
/// that sees a body is always marked.
/// Loop-safe: sized in the constructor.
class Footprint {
 public:
  Footprint(const CameraGeometry& camera, int beyond_frame_px, std::size_t vertices);

  /// The target alone.
  void project(const Mesh& mesh, const BodyView& view) noexcept {
    clear();
    static_cast<void>(add(mesh, view));
  }
  void clear() noexcept;
  /// Marks one body more, of as many vertices at most as the constructor was told; the pixels round
  /// it.
  PixelRect add(const Mesh& mesh, const BodyView& view) noexcept;

  /// What triangles have on the detector's plane, each for itself. One with a corner behind the
  /// camera counts for none.
  struct ImageArea {
    double all_px2 = 0;
    double in_frame_px2 = 0;
    ImageArea& operator+=(const ImageArea& more) noexcept {
      all_px2 += more.all_px2;
      in_frame_px2 += more.in_frame_px2;
      return *this;
    }
    /// The share that lies in the frame; 0 when there is no area.
    [[nodiscard]] double visible_fraction() const noexcept {
      return all_px2 > 0.0 ? std::min(1.0, in_frame_px2 / all_px2) : 0.0;
    }
  };
  /// Of the body that was added last.
  [[nodiscard]] const ImageArea& image_area() const noexcept { return image_area_; }
  [[nodiscard]] double visible_fraction() const noexcept { return image_area_.visible_fraction(); }

  /// Of the marked pixels; empty when all is out of sight.
  [[nodiscard]] PixelRect region() const noexcept { return region_; }
  /// Columns [begin, end) that hold the marked pixels of a row.
  struct Span {
    int begin = 0;
    int end = 0;
  };
  /// Pre: the row lies in region().
  [[nodiscard]] const Span& span(int v) const noexcept {
    return spans_[static_cast<std::size_t>(v - limits_.top)];
  }
  /// Pre: the pixel lies in region().
  [[nodiscard]] bool marked(int u, int v) const noexcept {
    return mask_[static_cast<std::size_t>(v - limits_.top) *
                     static_cast<std::size_t>(limits_.width()) +
                 static_cast<std::size_t>(u - limits_.left)] != 0;
  }

 private:
  void mark(const PixelRect& box) noexcept;
  [[nodiscard]] PixelRect box_round(const Mesh::Triangle& triangle) const noexcept;
  [[nodiscard]] ImageArea area_of(const Mesh& mesh) const noexcept;

  CameraGeometry camera_;
  PixelRect limits_;
  PixelRect region_;
  ImageArea image_area_;
  std::vector<std::uint8_t> mask_;
  std::vector<Span> spans_;
  std::vector<PixelPoint> corners_;
};

}  // namespace engine
