#pragma once

#include <memory>

#include "engine/render/far_light.h"
#include "engine/render/render_spec.h"

namespace engine {

/// Draws a target that is small on the detector from its light as a whole, and leaves a larger one
/// to the renderer that resolves it.
///
/// A small target's place on the grid and its edges would decide how much light it has. Here that
/// is FarLight's, and only divided by the range squared: flux times range squared is constant at
/// any distance. By what a pixel would show of the difference, as a share of the sensor's noise
/// there, the light is drawn as
///   point    at its centre: off by half the second derivative of the spread of light times the
///            second moments,
///   moments  4 to 64 points with all moments up to the second (LightParts),
///   image    FarLight's picture, each of its cells spread over the grid by area: as good as the
///            resolving renderer's grid, and with less noise; its error is told once a picture has
///            been whole;
/// and from kLargest_px on, or nearer than kNearest_radii where lines of sight are no longer
/// parallel, by the other renderer. Derivatives are those of the spread of light of the paper's
/// camera, scaled to this one's width. Once a finer form has been taken a coarser one is not until
/// the range has grown again by a tenth.
/// The grid's cover is that of the picture in all forms: what hides the Earth and stars.
/// Leaves out: what a nearby camera sees from the side, r / range of the light at most.
/// Thread: loop. Loop-safe but for the constructor.
class FarTarget final : public Renderer {
 public:
  static constexpr double kLargest_px = 24;
  static constexpr double kNearest_radii = 2000;

  FarTarget(const RenderSpec& spec, std::unique_ptr<Renderer> resolved,
            std::shared_ptr<TracedTarget> target, WorkerPool& pool);

  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  enum class Form : std::uint8_t { kPoint, kMoments, kMoments4, kMoments16, kImage };
  /// The picture on the detector: linear in its metres.
  struct View {
    PixelPoint centre;  ///< of the body's origin
    PixelPoint per_x;   ///< px/m
    PixelPoint per_y;
    [[nodiscard]] PixelPoint at(double x_m, double y_m) const noexcept {
      return {centre.u + x_m * per_x.u + y_m * per_y.u, centre.v + x_m * per_x.v + y_m * per_y.v};
    }
    [[nodiscard]] double px2_per_m2() const noexcept {
      return std::abs(per_x.u * per_y.v - per_x.v * per_y.u);
    }
  };

  [[nodiscard]] bool far_enough(const Snapshot& snapshot) noexcept;
  /// Where the target can be, as far as light from there matters; empty: nowhere.
  [[nodiscard]] PixelRect region_of(const Snapshot& snapshot) const noexcept;
  [[nodiscard]] View view_of(const Snapshot& snapshot) const noexcept;
  [[nodiscard]] double light_e(const View& view) const noexcept;
  /// Of the light, in the brightest pixel, were it a blot with its second moments.
  [[nodiscard]] double peak_share(const View& view) const noexcept;
  /// Of the light: what the brightest pixel may be off by without the sensor telling.
  [[nodiscard]] double unseen_share(const View& view) const noexcept;
  [[nodiscard]] double error_share(Form form, const View& view) const noexcept;
  [[nodiscard]] double image_error_share(const View& view) const noexcept;
  [[nodiscard]] Form choose_form(const Snapshot& snapshot, const View& view) noexcept;
  void draw_points(Form form, const View& view, Radiance& out) const noexcept;
  void draw_cells(bool with_light, const View& view, Radiance& out) const noexcept;
  [[nodiscard]] double share_in_frame(const View& view, const Radiance& out) const noexcept;

  RenderSpec spec_;
  std::unique_ptr<Renderer> resolved_;
  double radius_m_;
  FarLight light_;
  double width_;  ///< of the spread of light, over that of the paper's camera
  // Of the frames before.
  bool far_ = true;
  Form form_ = Form::kPoint;
  double refined_at_m_ = 0;  ///< range
};

}  // namespace engine
