#include "tools/tracker/sky.h"

#include <algorithm>
#include <numeric>

namespace tracker {
namespace {

constexpr int kEvery_px = 4;           // a block is judged by every so many pixels, each way
constexpr int kMostReach_blocks = 12;  // of the blocks around
constexpr int kReachShare = 3;         // or this part of the frame, where that is less
constexpr int kMostEvery_blocks = 2;   // and of these every other one, each way, if they are many
constexpr double kOneSigma = 0.841;    // what of a normal distribution stays under its sigma
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

/// Over all blocks and their neighbours, in DN a block: the mean of the middle third, which is
/// finer than a DN, and neither a step's nor a target's.
double Sky::slope(int columns_apart, int rows_apart) {
  levels_.clear();
  for (int row = 0; row + rows_apart < rows_; ++row)
    for (int column = 0; column + columns_apart < columns_; ++column)
      levels_.push_back(measured_[index(column + columns_apart, row + rows_apart)].level_dn -
                        measured_[index(column, row)].level_dn);
  if (levels_.empty()) return 0.0;
  std::sort(levels_.begin(), levels_.end());
  const auto third = static_cast<std::ptrdiff_t>(levels_.size() / 3);
  const auto begin = levels_.begin() + third;
  const auto end = levels_.end() - third;
  return std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin);
}

void Sky::take_plane_out() {
  slope_u_dn_ = slope(1, 0);
  slope_v_dn_ = slope(0, 1);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      measured_[index(column, row)].level_dn -= slope_u_dn_ * column + slope_v_dn_ * row;
}

void Sky::follow_majority() {
  const int reach = std::clamp(std::min(columns_, rows_) / kReachShare, 1, kMostReach_blocks);
  const int every = std::min(reach, kMostEvery_blocks);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      levels_.clear();
      noises_.clear();
      for (int r = row - reach; r <= row + reach; r += every) {
        if (r < 0 || r >= rows_) continue;
        for (int c = column - reach; c <= column + reach; c += every) {
          if (c < 0 || c >= columns_) continue;
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
