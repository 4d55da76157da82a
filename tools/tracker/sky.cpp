#include "tools/tracker/sky.h"

#include <algorithm>

namespace tracker {
namespace {

constexpr int kEvery_px = 4;         // a block is judged by every so many pixels, each way
constexpr int kReach_blocks = 12;    // of the blocks around
constexpr int kEvery_blocks = 2;     // and of these every other one, each way
constexpr double kOneSigma = 0.841;  // what of a normal distribution stays under its sigma
constexpr double kLeastNoise_dn = 0.5;

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Sky::Sky(int width_px, int height_px)
    : columns_((width_px + kBlock_px - 1) / kBlock_px),
      rows_((height_px + kBlock_px - 1) / kBlock_px),
      measured_(static_cast<std::size_t>(columns_ * rows_)),
      blocks_(measured_.size()) {}

void Sky::measure(const cv::Mat& image) {
  measure_blocks(image);
  take_plane_out();
  follow_majority();
}

void Sky::measure_blocks(const cv::Mat& image) {
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      pixels_.clear();
      for (int v = row * kBlock_px; v < std::min(image.rows, (row + 1) * kBlock_px);
           v += kEvery_px) {
        const auto* line = image.ptr<std::uint16_t>(v);
        for (int u = column * kBlock_px; u < std::min(image.cols, (column + 1) * kBlock_px);
             u += kEvery_px)
          pixels_.push_back(line[u]);
      }
      const auto rank = [&](double share) {
        return pixels_.begin() +
               static_cast<std::ptrdiff_t>(share * static_cast<double>(pixels_.size()));
      };
      const auto middle = rank(0.5);
      const auto high = rank(kOneSigma);
      std::nth_element(pixels_.begin(), middle, pixels_.end());
      const double level_dn = *middle;
      std::nth_element(middle, high, pixels_.end());
      measured_[index(column, row)] = {level_dn, *high - level_dn};
    }
  }
}

/// The median over all blocks and those that are so far from them, in DN a block.
double Sky::slope(int columns_apart, int rows_apart) {
  levels_.clear();
  for (int row = 0; row + rows_apart < rows_; ++row)
    for (int column = 0; column + columns_apart < columns_; ++column)
      levels_.push_back(measured_[index(column + columns_apart, row + rows_apart)].level_dn -
                        measured_[index(column, row)].level_dn);
  const int apart = columns_apart + rows_apart;
  return apart > 0 && !levels_.empty() ? median_of(levels_) / apart : 0.0;
}

void Sky::take_plane_out() {
  slope_u_dn_ = slope(columns_ / 2, 0);
  slope_v_dn_ = slope(0, rows_ / 2);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      measured_[index(column, row)].level_dn -= slope_u_dn_ * column + slope_v_dn_ * row;
}

void Sky::follow_majority() {
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      levels_.clear();
      noises_.clear();
      for (int r = std::max(0, row - kReach_blocks); r <= std::min(rows_ - 1, row + kReach_blocks);
           r += kEvery_blocks) {
        for (int c = std::max(0, column - kReach_blocks);
             c <= std::min(columns_ - 1, column + kReach_blocks); c += kEvery_blocks) {
          levels_.push_back(measured_[index(c, r)].level_dn);
          noises_.push_back(measured_[index(c, r)].noise_dn);
        }
      }
      blocks_[index(column, row)] = {median_of(levels_) + slope_u_dn_ * column + slope_v_dn_ * row,
                                     std::max(kLeastNoise_dn, median_of(noises_))};
    }
  }
}

}  // namespace tracker
