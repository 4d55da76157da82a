#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene/mesh.h"

namespace engine {

/// Which of many triangles each point of a lattice sees: a z-buffer, made for lattices finer than
/// the triangles.
///
/// Corners are given on the plane of the lattice in steps of it, with a nearness that is linear on
/// that plane: the nearest triangle is the one that is seen. Point (i, j) lies in step (i, j), at
/// one of eight places across it and one of eight down it, the same for each eight by eight points:
/// their 64 projections on either axis are evenly spaced, so that edges along the axes are met as
/// finely as others. Places are whole sixteenths of a step, and edges are evaluated in integers: of
/// triangles that share an edge exactly one covers a point on it.
///
/// Thread: place() the loop's; see() any, each band once. Loop-safe: sized in the constructor.
class TriangleRaster {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  /// Of the patterns that point places repeat in.
  static constexpr int kPeriod = 8;
  static constexpr std::int32_t kStep = 16;  ///< sixteenths
  /// Bit reversal of 0..7, at the middle of eighths, in sixteenths.
  static constexpr std::array<std::int32_t, kPeriod> kPlaceInStep = {1, 9, 5, 13, 3, 11, 7, 15};
  static constexpr int kLanes = 16;
  static constexpr int kMostBandRows = 64;

  struct Corner {
    double x = 0;  ///< in steps from the left edge of the first column
    double y = 0;
    double nearness = 0;
  };
  /// Where a point lies in its step; both in (0, 1).
  [[nodiscard]] static float x_in_step(int j) noexcept {
    return static_cast<float>(kPlaceInStep[static_cast<std::size_t>(j % kPeriod)]) / kStep;
  }
  [[nodiscard]] static float y_in_step(int i) noexcept { return x_in_step(i); }

  TriangleRaster(std::size_t vertices, std::size_t triangles, int most_bands);

  /// Takes the corners of one view: by vertex of the mesh. False: the view does not fit into the
  /// integers that this counts with, and nothing was taken. Bands are `band_rows` rows high.
  [[nodiscard]] bool place(const Mesh& mesh, std::span<const Corner> corners, int columns, int rows,
                           int band_rows) noexcept;
  [[nodiscard]] int bands() const noexcept { return bands_; }
  [[nodiscard]] int columns() const noexcept { return columns_; }
  /// Of a row of the buffers, whole lanes.
  [[nodiscard]] std::size_t stride() const noexcept { return stride_; }

  /// The triangles that band `band` sees, row by row, kNone where there is none. Both buffers hold
  /// band_rows * stride() values; `nearness` is of what is seen.
  void see(int band, std::span<std::uint32_t> seen, std::span<float> nearness) const noexcept;

 private:
  struct Place {
    std::int32_t x = 0;  // in sixteenths of a step
    std::int32_t y = 0;
    double nearness = 0;
  };
  /// Triangles of up to 2^level bands, by the one they begin in.
  struct Level {
    std::size_t first_bucket = 0;  // in bucket_begin_
    int buckets = 0;
  };
  static constexpr int kLevels = 12;

  [[nodiscard]] std::size_t bucket_of(std::uint32_t triangle) const noexcept;
  void see_triangle(std::uint32_t triangle, int first_row, std::span<std::uint32_t> seen,
                    std::span<float> nearness) const noexcept;

  const Mesh* mesh_ = nullptr;
  std::vector<Place> places_;
  std::vector<std::uint32_t> sorted_;  // triangles, bucket by bucket
  std::vector<std::uint32_t> bucket_begin_;
  std::array<Level, kLevels> levels_{};
  int most_bands_;
  int columns_ = 0;
  int rows_ = 0;
  int band_rows_ = 1;
  int bands_ = 0;
  std::size_t stride_ = 0;
};

}  // namespace engine
