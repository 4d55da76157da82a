#include "engine/render/pixel_tones.h"

namespace engine {
namespace {

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

PixelTones::PixelTones(const LatticeView& view) : view_(view) {
  constexpr std::size_t kMostPoints = TriangleRaster::kMostBandRows;
  tones_.reserve(kMostPoints * kMostPoints);
}

std::span<const PixelTones::Tone> PixelTones::find(std::span<const std::uint32_t> seen,
                                                   int column) noexcept {
  seen_ = seen.subspan(at(column * view_.points_a_pixel()));
  tones_.clear();
  const std::uint32_t first = seen_.front();
  if (!all_see(first)) {
    collect();
  } else if (first != TriangleRaster::kNone) {
    tones_.push_back(whole_pixel(first));
  }
  return tones_;
}

bool PixelTones::all_see(std::uint32_t facet) const noexcept {
  const int n = view_.points_a_pixel();
  std::uint32_t differs = 0;
  for (int y = 0; y < n; ++y) {
    const std::uint32_t* seen = &seen_[at(y) * view_.stride()];
    for (int x = 0; x < n; ++x) differs |= seen[x] ^ facet;
  }
  return differs == 0;
}

/// By runs of one facet in a row of points of a cell.
void PixelTones::collect() noexcept {
  const int n = view_.points_a_pixel();
  const int side = view_.side();
  std::size_t last = 0;
  for (int y = 0; y < n; ++y) {
    const std::uint32_t* seen = &seen_[at(y) * view_.stride()];
    for (int cell_x = 0; cell_x < n; cell_x += side) {
      int begin = cell_x;
      for (int x = cell_x + 1; x <= cell_x + side; ++x) {
        if (x < cell_x + side && seen[x] == seen[begin]) continue;
        if (seen[begin] != TriangleRaster::kNone) add_run(last, seen[begin], begin, y, x - begin);
        begin = x;
      }
    }
  }
}

void PixelTones::add_run(std::size_t& last, std::uint32_t facet, int x, int y,
                         int length) noexcept {
  if (last >= tones_.size() || tones_[last].facet != facet) {
    for (last = 0; last < tones_.size() && tones_[last].facet != facet;) ++last;
    if (last == tones_.size()) {
      tones_.emplace_back();
      tones_.back().facet = facet;
    }
  }
  Tone& tone = tones_[last];
  const auto points = static_cast<unsigned>(length);
  const int cells = view_.points_a_pixel() / view_.side();
  const std::size_t cell = at(y / view_.side() * cells + x / view_.side());
  const auto add_to = [cell](auto& sums, unsigned more) {
    sums[cell] = static_cast<std::uint16_t>(sums[cell] + more);
  };
  tone.points += points;
  add_to(tone.in_cell, points);
  add_to(tone.sum_x, points * (2U * static_cast<unsigned>(x) + points));
  add_to(tone.sum_y, points * (2U * static_cast<unsigned>(y) + 1U));
}

/// A pixel that sees nothing else.
PixelTones::Tone PixelTones::whole_pixel(std::uint32_t facet) const noexcept {
  const auto side = static_cast<unsigned>(view_.side());
  const unsigned s = static_cast<unsigned>(view_.points_a_pixel()) / side;
  Tone tone;
  tone.facet = facet;
  tone.points = s * s * side * side;
  for (unsigned cell = 0; cell < s * s; ++cell) {
    tone.in_cell[cell] = static_cast<std::uint16_t>(side * side);
    tone.sum_x[cell] = static_cast<std::uint16_t>(side * side * side * (2U * (cell % s) + 1U));
    tone.sum_y[cell] = static_cast<std::uint16_t>(side * side * side * (2U * (cell / s) + 1U));
  }
  return tone;
}

}  // namespace engine
