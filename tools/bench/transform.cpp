#include "tools/bench/transform.h"

#include <algorithm>
#include <array>
#include <span>

namespace bench {

using engine::Lanes;

namespace {

constexpr std::size_t kLanes = Lanes::kCount;

}  // namespace

Transform::Transform(int width, int height)
    : width_(static_cast<std::size_t>(width)),
      height_(static_cast<std::size_t>(height)),
      lines_(std::array{width, height}),
      row_(width_),
      // As many as whole fours take: what stands beyond the spectrum is nothing.
      half_((width_ / 2 / kLanes + 1) * kLanes),
      column_(height_),
      spectrum_(half_.size() / kLanes * height_) {}

void Transform::there_and_back() {
  there();
  back();
}

void Transform::there() {
  const auto half = std::span(half_).first(width_ / 2 + 1);
  for (std::size_t y = 0; y < height_; y += kLanes) {
    lines_.forward(std::span<const Lanes>(row_), half);
    // As far as its memory goes, turning rows into columns is part of it.
    for (std::size_t x = 0; x < half_.size(); x += kLanes)
      std::copy_n(&half_[x], kLanes, &spectrum_[x / kLanes * height_ + y]);
  }
  for (std::size_t at = 0; at < spectrum_.size(); at += height_) {
    const auto line = std::span(spectrum_).subspan(at, height_);
    lines_.forward(std::span<const Complex>(line), std::span(column_));
    std::ranges::copy(column_, line.begin());
  }
}

void Transform::back() {
  for (std::size_t at = 0; at < spectrum_.size(); at += height_) {
    const auto line = std::span(spectrum_).subspan(at, height_);
    lines_.inverse(std::span<const Complex>(line), std::span(column_));
    std::ranges::copy(column_, line.begin());
  }
  const auto half = std::span<const Complex>(half_).first(width_ / 2 + 1);
  for (std::size_t y = 0; y < height_; y += kLanes) {
    for (std::size_t x = 0; x < half_.size(); x += kLanes)
      std::copy_n(&spectrum_[x / kLanes * height_ + y], kLanes, &half_[x]);
    lines_.inverse(half, std::span(row_));
  }
}

}  // namespace bench
