#pragma once

#include <memory>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

/// Bends the image that another renderer drew with the distortion affine about the target
/// (LocalCamera), to the distortion as it is: for a target that fills much of a bent field.
///
/// Left alone where no place of the image would move by kSeen_px. Else each cell takes what the
/// other image has where its centre belongs, by Lagrange's cubic: of detail at the pixels' Nyquist
/// frequency up to 2.6 % is lost with three cells to a pixel, and an edge has a rim of at most 7 %
/// of its height, a third of a pixel wide. Where cells belong is worked out every kNode_px px.
/// Leaves out: what the other image has not, where a bend of more than GridWish::beyond_frame_px
/// draws on light from beyond the frame; the change of a rolling shutter's stretch over the field.
/// Thread: loop. Loop-safe but for the constructor.
class CurvedRenderer final : public Renderer {
 public:
  static constexpr double kSeen_px = 0.05;
  static constexpr int kNode_px = 8;

  CurvedRenderer(const CameraGeometry& camera, const GridWish& wish,
                 std::unique_ptr<Renderer> affine, WorkerPool& pool);

  /// Adds a rung: ladder "distortion", "affine" or "curved".
  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  /// Both ways between the two images of one snapshot.
  class Bend;

  [[nodiscard]] PixelRect bent_region(const Bend& bend, const PixelRect& region) const noexcept;
  void find_nodes(const Bend& bend, const PixelRect& region) noexcept;
  void draw(const PixelRect& from_region, const PixelRect& region, int oversampling,
            RadianceImage& grid, CoverImage& cover) noexcept;

  CameraGeometry camera_;
  GridWish wish_;
  std::unique_ptr<Renderer> affine_;
  WorkerPool& pool_;
  std::vector<PixelPoint> nodes_;  ///< [row][column]: where a place belongs, less that place
  int nodes_across_ = 0;
  RadianceImage spare_grid_;
  CoverImage spare_cover_;
};

}  // namespace engine
