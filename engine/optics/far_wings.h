#pragma once

#include <array>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/blur.h"
#include "engine/optics/grid_otf.h"

namespace engine {

/// How a lens spreads light far out, averaged over a turn: share / r^3 of it to a pixel r pixels
/// away, and the next term, next / r^5. Light that edges of the pupil turn aside; aberrations and
/// the pixel's size change the next term only.
struct WingLaw {
  double share_px = 0;  ///< lambda N / (pi^3 p (1 - obscuration))
  double next_px3 = 0;
};

/// The far wings of the spread of light, on cells of two pixels: what is smooth needs no fine grid.
///
/// Two softened laws c / (r^2 + s^2)^(3/2) that together follow the law from s on; each has the
/// transform 2 pi c / s exp(-2 pi s f) (Bracewell 2000, The Fourier Transform and Its Applications,
/// table of Hankel transforms), which the fine grid's OTF is then free of, exactly: what is
/// left of a point's image there ends within three s but for its rings. The wings' OTF fades out
/// below the cells' own limit. Leaves out: rings, a spider's spikes, and copies of the wings beyond
/// where they are followed, together no more than what is faint. Thread: loop. Loop-safe but for
/// the constructor.
class FarWings {
 public:
  static constexpr int kCell_px = 2;

  /// `width`: of a point's image, 1 for that of the paper's camera. `longest_px`: of the picture
  /// with its wings.
  FarWings(const WingLaw& law, double width, int longest_px, WorkerPool& pool);

  /// What the fine grid need not spread: in cycles per pixel.
  [[nodiscard]] double otf(double per_px) const noexcept;
  [[nodiscard]] RadialOtf table() const noexcept;  ///< of it, up to the cells' own limit

  /// Takes the light in: `picture` in cells of 1/oversampling px, the first at the corner of
  /// pixel (region.left, region.top).
  void gather(const RadianceImage& picture, const PixelRect& region, int oversampling) noexcept;

  /// Spreads what was gathered, followed for `reach_px`.
  void transform(int reach_px, const ImageMotion& motion) noexcept;
  /// Adds `scale` times the wings, moved by so much, to `out` as far as they are followed.
  void add(PixelPoint move_px, double scale, IrradianceImage& out) noexcept;

 private:
  WorkerPool& pool_;
  GridOtf grid_otf_;
  Blur blur_;
  std::array<double, 2> softness_px_;
  std::array<double, 2> strength_;  ///< of each law: 2 pi c / s
  std::vector<float> table_;
  RadianceImage cells_;
  std::vector<float> lines_;  ///< [row of cells][column of the picture]
  PixelRect covered_;         ///< in cells from the detector's corner
  int margin_x_ = 0;
  int margin_y_ = 0;
  std::vector<float> wide_;  ///< [cell row][pixel]
};

}  // namespace engine
