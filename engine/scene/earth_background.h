#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/earth.h"

namespace engine {

/// The Earth as the camera sees it.
struct EarthInFrame {
  EarthDisc<CameraFrame> disc;  ///< from the camera; not seen: nothing is drawn
  Air air;                      ///< optical_depth 0: a sharp limb
};

/// The Earth's light at the places of a frame: its disc, the terminator as wide as the Sun's own
/// disc makes it, and the air above the limb.
///
/// Air: it glows as the ground below it would and hides what lies behind, both by the share
/// 1 - exp(-tau) of the chord through an exponential atmosphere, tau = tau_0 sqrt(2 pi R/H)
/// exp(-h/H): what an even source gives (Chandrasekhar 1960, Radiative Transfer, chapter I), the
/// source being the limb's own ground. The albedo is that of ground and air together, so before the
/// disc no air is added. Leaves out twilight, when air is lit above ground that is not: up to 4 deg
/// beyond the terminator at two scale heights; colour; refraction; clouds.
///
/// Of a far smaller scale than anything but its edges, it is worked out for nodes each kBlock_px
/// and interpolated. A block where that could be wrong by more than kUnseenShare of its light, or
/// kDarkShare of ground under the Sun, as the nodes' second differences tell it, and one with a
/// limb that is no smoother, is worked out for every pixel: .09 sigma of shot noise at 30 000 e-.
/// Thread: loop; any for what is const. Loop-safe but for reserve().
class EarthBackground {
 public:
  static constexpr int kBlock_px = 16;
  static constexpr double kUnseenShare = 5e-4;
  static constexpr double kDarkShare = 1e-5;

  /// Room for a frame and what lies up to `beyond_frame_px` outside it. May allocate.
  void reserve(const CameraGeometry& camera, int beyond_frame_px);
  /// `sky_w_m2_sr` is what lies behind: it goes where the Earth comes.
  void draw(const EarthInFrame& earth, double sky_w_m2_sr) noexcept;

  /// There is no Earth in the frame: at() is 0 everywhere. A fresh one is empty.
  [[nodiscard]] bool empty() const noexcept { return empty_; }
  /// What the Earth adds to the sky at a place, in W/m^2/sr; below 0 where it is darker. Exact.
  [[nodiscard]] double at(PixelPoint place) const noexcept;
  /// Adds `scale` times that, interpolated, to the pixels of row `v` from column `left` on. Places
  /// beyond what reserve() was told take the light of the nearest.
  void add_row(int v, int left, float scale, std::span<float> out) const noexcept;

 private:
  [[nodiscard]] double toward(const Eigen::Vector3d& unit, double passes_at_radii) const noexcept;
  [[nodiscard]] double mean_over_pixel(int u, int v) const noexcept;
  [[nodiscard]] std::size_t node(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] double interpolation_error(int column, int row) const noexcept;
  void find_fine_blocks(double block_radii, bool thin_air) noexcept;
  void add_block(int v, int from, int to, int column, float scale, float* out) const noexcept;

  CameraGeometry camera_;
  PixelRect region_;  ///< what the nodes cover, at the least
  int columns_ = 0;   ///< of nodes
  int rows_ = 0;
  bool empty_ = true;
  EarthInFrame earth_;
  double sky_w_m2_sr_ = 0;
  double top_of_air_radii_ = 1;
  int sub_samples_ = 1;             ///< on a pixel's side, where its block is fine
  std::vector<float> light_;        ///< of nodes
  std::vector<float> passes_at_;    ///< of nodes, in radii
  std::vector<std::uint8_t> fine_;  ///< by a block's first node
};

}  // namespace engine
