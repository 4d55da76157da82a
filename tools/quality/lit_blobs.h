#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "tools/quality/background.h"

namespace quality {

/// Pixels of a row that stand out: columns [begin, end).
struct LitRun {
  int row = 0;
  int begin = 0;
  int end = 0;
  std::size_t parent = 0;  ///< a run of the same blob
  double light_dn = 0;     ///< above the background
  double power_dn2 = 0;
  double peak_dn = 0;
};

/// Pixels that touch each other, by sides or corners.
struct Blob {
  engine::PixelRect box;
  int pixels = 0;
  double light_dn = 0;
  double power_dn2 = 0;   ///< sum of squares above the background
  double peak_dn = 0;     ///< above it
  int at_border_px = 0;   ///< sides of pixels that are the frame's border
  std::size_t first = 0;  ///< its run that the others lead to
};

/// Finds the group of connected pixels over three sigma that is the target: two at least, one of
/// them over five sigma, and the most light. What lies along the frame's border for more than 1.8
/// times the root of its area, as the Earth with its limb does (over twice), and no target of which
/// half is in the frame (a half disc: 1.6), comes last. Over an uneven background all are alike,
/// and pixels may be darker than it. Thread: one. Loop-safe once built for the largest size.
class BlobFinder {
 public:
  BlobFinder(int largest_width_px, int largest_height_px);
  /// Without pixels when there is none. A frame with more runs than there is room for, half of
  /// which is noise, is one blob as a whole.
  [[nodiscard]] Blob find(const engine::DnImage& frame, const BackgroundMeter& background) noexcept;
  /// All runs, row by row; those of a blob are those whose root() is its first.
  [[nodiscard]] std::span<const LitRun> runs() const noexcept { return runs_; }
  [[nodiscard]] std::size_t root(std::size_t run) const noexcept;

 private:
  [[nodiscard]] bool add_row(const engine::DnImage& frame, int row,
                             const BackgroundMeter& background) noexcept;
  [[nodiscard]] bool add_runs_of_tile(std::span<const std::uint16_t> pixels, int row, int first,
                                      const BackgroundMeter& background) noexcept;
  void join_rows(std::size_t above, std::size_t here) noexcept;
  void gather(const engine::DnImage& frame) noexcept;
  [[nodiscard]] Blob best(bool even, double least_peak_dn) const noexcept;

  std::vector<LitRun> runs_;
  std::vector<Blob> blobs_;  // of each run that is a root
};

}  // namespace quality
