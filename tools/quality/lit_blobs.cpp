#include "tools/quality/lit_blobs.h"

#include <algorithm>
#include <cmath>

namespace quality {
namespace {

constexpr double kNearSigmas = 3.0;
constexpr double kSureSigmas = 5.0;
// Noise makes one in 740 pixels a run: 1.4 to a row of 1024.
constexpr std::size_t kRunsPerRow = 48;
// Of a blob's length along the border over the root of its area.
constexpr double kAlongBorder = 1.8;

struct Limits {
  int low = 0;   ///< pixels below stand out
  int high = 0;  ///< pixels above do
};

/// In 16 bits, so that the compiler compares eight at once.
bool any_outside(std::span<const std::uint16_t> pixels, const Limits& limits) {
  const auto low = static_cast<std::uint16_t>(std::clamp(limits.low, 0, 65535));
  const auto high = static_cast<std::uint16_t>(std::clamp(limits.high, 0, 65535));
  std::uint16_t any = 0;
  for (const std::uint16_t p : pixels)
    any = static_cast<std::uint16_t>(any | (p < low ? 1 : 0) | (p > high ? 1 : 0));
  return any != 0;
}

}  // namespace

BlobFinder::BlobFinder(int largest_width_px, int largest_height_px) {
  const std::size_t most = kRunsPerRow * static_cast<std::size_t>(largest_height_px) +
                           static_cast<std::size_t>(largest_width_px);
  runs_.reserve(most);
  blobs_.resize(most);
}

std::size_t BlobFinder::root(std::size_t run) const noexcept {
  while (runs_[run].parent != run) run = runs_[run].parent;
  return run;
}

Blob BlobFinder::find(const engine::DnImage& frame, const BackgroundMeter& background) noexcept {
  runs_.clear();
  std::size_t above = 0;
  for (int v = 0; v < frame.height(); ++v) {
    const std::size_t here = runs_.size();
    if (!add_row(frame, v, background)) {
      runs_.clear();
      Blob whole;
      whole.box = {0, 0, frame.width(), frame.height()};
      whole.pixels = frame.width() * frame.height();
      return whole;
    }
    join_rows(above, here);
    above = here;
  }
  gather(frame);
  return best(background.even(), kSureSigmas * std::sqrt(background.variance_dn2()));
}

bool BlobFinder::add_row(const engine::DnImage& frame, int row,
                         const BackgroundMeter& background) noexcept {
  const int tile_px = background.tile_px();
  const std::span<const std::uint16_t> pixels = frame.row(row);
  for (int first = 0; first < frame.width(); first += tile_px) {
    const int n = std::min(tile_px, frame.width() - first);
    const auto tile = pixels.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(n));
    if (!add_runs_of_tile(tile, row, first, background)) return false;
  }
  return true;
}

bool BlobFinder::add_runs_of_tile(std::span<const std::uint16_t> pixels, int row, int first,
                                  const BackgroundMeter& background) noexcept {
  const double level = background.level_dn(first, row);
  const double near_dn = kNearSigmas * std::sqrt(background.variance_dn2());
  const Limits limits{static_cast<int>(std::ceil(level - near_dn)),
                      static_cast<int>(std::floor(level + near_dn))};
  if (!any_outside(pixels, limits)) return true;
  int column = first;
  for (const std::uint16_t p : pixels) {
    const int u = column++;
    if (p >= limits.low && p <= limits.high) continue;
    const bool goes_on = !runs_.empty() && runs_.back().row == row && runs_.back().end == u;
    if (!goes_on) {
      if (runs_.size() == runs_.capacity()) return false;
      runs_.push_back({row, u, u, runs_.size(), 0.0, 0.0, 0.0});
    }
    LitRun& run = runs_.back();
    const double above = std::abs(p - level);
    run.end = u + 1;
    run.light_dn += above;
    run.power_dn2 += above * above;
    run.peak_dn = std::max(run.peak_dn, above);
  }
  return true;
}

void BlobFinder::join_rows(std::size_t above, std::size_t here) noexcept {
  std::size_t i = above;
  for (std::size_t j = here; j < runs_.size();) {
    if (i == here) return;
    const LitRun& a = runs_[i];
    const LitRun& b = runs_[j];
    // Corners touch, too.
    if (a.begin <= b.end && b.begin <= a.end) {
      const std::size_t one = root(i);
      const std::size_t other = root(j);
      runs_[std::max(one, other)].parent = std::min(one, other);
    }
    if (a.end < b.end) {
      ++i;
    } else {
      ++j;
    }
  }
}

void BlobFinder::gather(const engine::DnImage& frame) noexcept {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    LitRun& run = runs_[i];
    // The first of a blob comes before its others, so that chains stay short.
    run.parent = root(i);
    if (run.parent == i) {
      blobs_[i] = {};
      blobs_[i].first = i;
    }
    Blob& blob = blobs_[run.parent];
    blob.box = blob.box.joined_with({run.begin, run.row, run.end, run.row + 1});
    blob.pixels += run.end - run.begin;
    blob.light_dn += run.light_dn;
    blob.power_dn2 += run.power_dn2;
    blob.peak_dn = std::max(blob.peak_dn, run.peak_dn);
    const int length = run.end - run.begin;
    blob.at_border_px += (run.row == 0 ? length : 0) +
                         (run.row + 1 == frame.height() ? length : 0) + (run.begin == 0 ? 1 : 0) +
                         (run.end == frame.width() ? 1 : 0);
  }
}

Blob BlobFinder::best(bool even, double least_peak_dn) const noexcept {
  Blob inside;
  Blob along;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Blob& blob = blobs_[i];
    if (runs_[i].parent != i || blob.pixels < 2 || blob.peak_dn <= least_peak_dn) continue;
    Blob& other =
        even && blob.at_border_px > kAlongBorder * std::sqrt(blob.pixels) ? along : inside;
    if (blob.light_dn > other.light_dn) other = blob;
  }
  return inside.pixels > 0 ? inside : along;
}

}  // namespace quality
