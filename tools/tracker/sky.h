#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace tracker {

/// What lies behind the target, block by block: how bright it is, and how noisy.
///
/// The median of each block, less a plane that has the frame's usual slope; of that the median
/// over the blocks around, two thirds of the frame wide: a target is no majority there. So
/// the level follows a gradient, and a step as far as its straight edge.
/// Leaves out: what is finer than a block; a target that covers half of the frame is its sky.
class Sky {
 public:
  static constexpr int kBlock_px = 32;

  struct Block {
    double level_dn = 0;
    double noise_dn = 0;  ///< 0.5 at least: quantising hides what is less
  };

  Sky(int width_px, int height_px);

  /// Of an image of 16-bit pixels of this size.
  void measure(const cv::Mat& image);
  [[nodiscard]] const Block& at(int u, int v) const noexcept {
    return blocks_[index(u / kBlock_px, v / kBlock_px)];
  }

 private:
  void measure_blocks(const cv::Mat& image);
  void take_plane_out();
  void follow_majority();
  [[nodiscard]] double slope(int columns_apart, int rows_apart);
  [[nodiscard]] std::size_t index(int column, int row) const noexcept {
    const int number = row * columns_ + column;
    return static_cast<std::size_t>(number);
  }

  int columns_;
  int rows_;
  double slope_u_dn_ = 0;  ///< a block
  double slope_v_dn_ = 0;
  std::vector<Block> measured_;  ///< each from its own pixels, the plane taken out
  std::vector<Block> blocks_;
  std::vector<std::uint16_t> pixels_;  // scratch
  std::vector<double> levels_;         // scratch
  std::vector<double> noises_;         // scratch
};

}  // namespace tracker
