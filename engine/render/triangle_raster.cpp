#include "engine/render/triangle_raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::int32_t kStep = TriangleRaster::kStep;
constexpr auto& kPlaceInStep = TriangleRaster::kPlaceInStep;
// Corners within this many sixteenths: what an edge changes by over kLanes steps and 32 rows stays
// below 2^30. Bands of more rows take half of it.
constexpr double kLimit = 1 << 19;
constexpr int kManyRows = 32;
constexpr std::int64_t kFar = 1 << 30;

struct EdgeFunction {
  std::int64_t at_zero = 0;  // >= 0 inside
  std::int32_t per_x = 0;
  std::int32_t per_y = 0;
};

/// Positive to the left of a -> b where y points down; a point on the edge belongs to one side.
EdgeFunction edge(std::int64_t ax, std::int64_t ay, std::int64_t bx, std::int64_t by) noexcept {
  EdgeFunction e;
  e.per_x = static_cast<std::int32_t>(ay - by);
  e.per_y = static_cast<std::int32_t>(bx - ax);
  e.at_zero = ax * by - bx * ay;
  const bool owns = e.per_x > 0 || (e.per_x == 0 && e.per_y > 0);
  if (!owns) --e.at_zero;
  return e;
}

constexpr std::array<std::int32_t, TriangleRaster::kLanes> kLaneX = [] {
  std::array<std::int32_t, TriangleRaster::kLanes> x{};
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = kStep * static_cast<std::int32_t>(i);
  return x;
}();
constexpr std::array<std::int32_t, TriangleRaster::kLanes> kLaneY = [] {
  std::array<std::int32_t, TriangleRaster::kLanes> y{};
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = kPlaceInStep[i % kPlaceInStep.size()];
  return y;
}();

/// One triangle and kLanes columns of a band.
struct Block {
  std::array<std::int32_t, 3> edge;  // at the block's first step, its upper left corner
  std::array<std::int32_t, 3> per_x;
  std::array<std::int32_t, 3> per_y;
  float nearness = 0;  // the same
  float nearness_per_x = 0;
  float nearness_per_y = 0;
  std::uint32_t triangle = 0;
  int rows = 0;
  int first_row = 0;  // in the pattern
};

[[gnu::always_inline]] inline void cover(const Block block, std::uint32_t* __restrict seen,
                                         float* __restrict nearness, std::size_t stride) noexcept {
  const Block b = block;
  constexpr int kLanes = TriangleRaster::kLanes;
  alignas(64) std::array<std::int32_t, kLanes> e0;
  alignas(64) std::array<std::int32_t, kLanes> e1;
  alignas(64) std::array<std::int32_t, kLanes> e2;
  alignas(64) std::array<float, kLanes> near;
  for (std::size_t l = 0; l < kLanes; ++l) {
    const std::int32_t x = kLaneX[l];
    const std::int32_t y = kLaneY[l];
    e0[l] = b.edge[0] + b.per_x[0] * x + b.per_y[0] * y;
    e1[l] = b.edge[1] + b.per_x[1] * x + b.per_y[1] * y;
    e2[l] = b.edge[2] + b.per_x[2] * x + b.per_y[2] * y;
    near[l] = b.nearness + b.nearness_per_x * static_cast<float>(x) +
              b.nearness_per_y * static_cast<float>(y);
  }
  const std::uint32_t triangle = b.triangle;
  for (int j = 0; j < b.rows; ++j) {
    const std::int32_t x =
        kPlaceInStep[static_cast<std::size_t>(b.first_row + j) % kPlaceInStep.size()];
    const std::int32_t y = kStep * j;
    const std::int32_t d0 = b.per_x[0] * x + b.per_y[0] * y;
    const std::int32_t d1 = b.per_x[1] * x + b.per_y[1] * y;
    const std::int32_t d2 = b.per_x[2] * x + b.per_y[2] * y;
    const float dn =
        b.nearness_per_x * static_cast<float>(x) + b.nearness_per_y * static_cast<float>(y);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::int32_t outside = ((e0[l] + d0) | (e1[l] + d1) | (e2[l] + d2)) >> 31;
      const float n = near[l] + dn;
      const bool wins = (outside == 0) & (n > nearness[l]);
      nearness[l] = wins ? n : nearness[l];
      seen[l] = wins ? triangle : seen[l];
    }
    nearness += stride;
    seen += stride;
  }
}

using Cover = void (*)(const Block&, std::uint32_t*, float*, std::size_t) noexcept;

void cover_plain(const Block& b, std::uint32_t* s, float* n, std::size_t w) noexcept {
  cover(b, s, n, w);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void cover_avx2(const Block& b, std::uint32_t* s, float* n,
                                                std::size_t w) noexcept {
  cover(b, s, n, w);
}
// GCC's own attribute: it takes half registers else.
// NOLINTNEXTLINE(clang-diagnostic-ignored-attributes)
__attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,prefer-vector-width=512"))) void
cover_avx512(const Block& b, std::uint32_t* s, float* n, std::size_t w) noexcept {
  cover(b, s, n, w);
}
#endif

Cover best_cover() noexcept {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq"))
    return cover_avx512;
  if (__builtin_cpu_supports("avx2")) return cover_avx2;
#endif
  return cover_plain;
}
const Cover kCover = best_cover();

int floor_div(std::int32_t a, int b) noexcept { return (a >= 0 ? a : a - (b - 1)) / b; }

}  // namespace

TriangleRaster::TriangleRaster(std::size_t vertices, std::size_t triangles, int most_bands)
    : places_(vertices), sorted_(triangles), most_bands_(most_bands) {
  // Over all levels, at most twice as many buckets as bands, and two more for each.
  bucket_begin_.reserve(2 * static_cast<std::size_t>(most_bands) + std::size_t{2} * kLevels + 1);
}

bool TriangleRaster::place(const Mesh& mesh, std::span<const Corner> corners, int columns, int rows,
                           int band_rows) noexcept {
  ENSURE(band_rows > 0 && band_rows <= kMostBandRows && columns >= 0 && rows >= 0);
  const double limit = band_rows > kManyRows ? 0.5 * kLimit : kLimit;
  for (const Corner& c : corners) {
    if (!(std::abs(c.x) * kStep < limit && std::abs(c.y) * kStep < limit)) return false;
  }
  mesh_ = &mesh;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    places_[i] = {static_cast<std::int32_t>(std::lround(corners[i].x * kStep)),
                  static_cast<std::int32_t>(std::lround(corners[i].y * kStep)),
                  corners[i].nearness};
  }
  columns_ = columns;
  rows_ = rows;
  band_rows_ = band_rows;
  bands_ = (rows + band_rows - 1) / band_rows;
  ENSURE(bands_ <= most_bands_);
  stride_ = static_cast<std::size_t>((columns + kLanes - 1) / kLanes) * kLanes;
  std::size_t buckets = 0;
  for (int k = 0; k < kLevels; ++k) {
    Level& level = levels_[static_cast<std::size_t>(k)];
    level.first_bucket = buckets;
    level.buckets = (bands_ >> k) + 2;
    buckets += static_cast<std::size_t>(level.buckets);
  }
  bucket_begin_.assign(buckets + 1, 0);
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::size_t b = bucket_of(t);
    if (b != buckets) ++bucket_begin_[b];
  }
  // Counts become ends, and filling from the back makes them beginnings.
  for (std::size_t b = 1; b < buckets; ++b) bucket_begin_[b] += bucket_begin_[b - 1];
  bucket_begin_[buckets] = buckets > 0 ? bucket_begin_[buckets - 1] : 0;
  for (std::uint32_t t = count; t-- > 0;) {
    const std::size_t b = bucket_of(t);
    if (b != buckets) sorted_[--bucket_begin_[b]] = t;
  }
  return true;
}

/// The number of buckets for a triangle that no band can see.
std::size_t TriangleRaster::bucket_of(std::uint32_t triangle) const noexcept {
  const std::size_t none = bucket_begin_.size() - 1;
  const auto& c = mesh_->triangles[triangle].corner;
  const Place& p = places_[c[0]];
  const Place& q = places_[c[1]];
  const Place& r = places_[c[2]];
  const std::int32_t right = std::max({p.x, q.x, r.x});
  const std::int32_t left = std::min({p.x, q.x, r.x});
  if (right < 0 || left >= columns_ * kStep) return none;
  const int height = band_rows_ * kStep;
  const int first = std::max(0, floor_div(std::min({p.y, q.y, r.y}), height));
  const int last = std::min(bands_ - 1, floor_div(std::max({p.y, q.y, r.y}), height));
  if (last < first) return none;
  int k = 0;
  while (k + 1 < kLevels && (1 << k) < last - first + 1) ++k;
  // The last level has one bucket for all that is longer.
  const int bucket = first >> k;
  return levels_[static_cast<std::size_t>(k)].first_bucket + static_cast<std::size_t>(bucket);
}

void TriangleRaster::see(int band, std::span<std::uint32_t> seen,
                         std::span<float> nearness) const noexcept {
  const std::size_t used = static_cast<std::size_t>(band_rows_) * stride_;
  ENSURE(seen.size() >= used && nearness.size() >= used);
  std::fill_n(seen.begin(), used, kNone);
  std::fill_n(nearness.begin(), used, -std::numeric_limits<float>::infinity());
  for (int k = 0; k < kLevels; ++k) {
    const Level& level = levels_[static_cast<std::size_t>(k)];
    // What is up to 2^k bands long and reaches this one began in this bucket or the one before.
    const int here = band >> k;
    for (int b = std::max(0, here - 1); b <= here; ++b) {
      const std::size_t bucket = level.first_bucket + static_cast<std::size_t>(b);
      for (std::uint32_t i = bucket_begin_[bucket]; i < bucket_begin_[bucket + 1]; ++i)
        see_triangle(sorted_[i], band * band_rows_, seen, nearness);
    }
  }
}

void TriangleRaster::see_triangle(std::uint32_t triangle, int band_row,
                                  std::span<std::uint32_t> seen,
                                  std::span<float> nearness) const noexcept {
  const auto& c = mesh_->triangles[triangle].corner;
  const Place& a = places_[c[0]];
  const Place* b = &places_[c[1]];
  const Place* d = &places_[c[2]];
  const int band_end = std::min(rows_, band_row + band_rows_);
  const int first_row = std::max(band_row, floor_div(std::min({a.y, b->y, d->y}), kStep));
  const int end_row = std::min(band_end, floor_div(std::max({a.y, b->y, d->y}), kStep) + 1);
  const int first_column = std::max(0, floor_div(std::min({a.x, b->x, d->x}), kStep));
  const int end_column = std::min(columns_, floor_div(std::max({a.x, b->x, d->x}), kStep) + 1);
  if (first_row >= end_row || first_column >= end_column) return;
  auto area = static_cast<std::int64_t>(b->x - a.x) * (d->y - a.y) -
              static_cast<std::int64_t>(d->x - a.x) * (b->y - a.y);
  if (area == 0) return;
  if (area < 0) {
    std::swap(b, d);
    area = -area;
  }
  const std::array<EdgeFunction, 3> edges = {
      edge(a.x, a.y, b->x, b->y), edge(b->x, b->y, d->x, d->y), edge(d->x, d->y, a.x, a.y)};
  const double near_b = b->nearness - a.nearness;
  const double near_d = d->nearness - a.nearness;
  const double scale = 1.0 / static_cast<double>(area);
  const double per_x = scale * (near_b * (d->y - a.y) - near_d * (b->y - a.y));
  const double per_y = scale * (near_d * (b->x - a.x) - near_b * (d->x - a.x));

  Block block;
  block.triangle = triangle;
  block.rows = end_row - first_row;
  block.first_row = first_row;
  block.nearness_per_x = static_cast<float>(per_x);
  block.nearness_per_y = static_cast<float>(per_y);
  for (int column = first_column / kLanes * kLanes; column < end_column; column += kLanes) {
    const std::int64_t x = static_cast<std::int64_t>(column) * kStep;
    const std::int64_t y = static_cast<std::int64_t>(first_row) * kStep;
    bool outside = false;
    for (std::size_t e = 0; e < 3; ++e) {
      const EdgeFunction& f = edges[e];
      const std::int64_t here = f.at_zero + f.per_x * x + f.per_y * y;
      const std::int64_t most = here + std::max<std::int64_t>(0, f.per_x) * kLanes * kStep +
                                std::max<std::int64_t>(0, f.per_y) * block.rows * kStep;
      outside = outside || most < 0;
      block.edge[e] = static_cast<std::int32_t>(std::clamp(here, -kFar, kFar));
      block.per_x[e] = f.per_x;
      block.per_y[e] = f.per_y;
    }
    if (outside) continue;
    block.nearness = static_cast<float>(a.nearness + per_x * static_cast<double>(x - a.x) +
                                        per_y * static_cast<double>(y - a.y));
    const std::size_t at =
        static_cast<std::size_t>(first_row - band_row) * stride_ + static_cast<std::size_t>(column);
    kCover(block, seen.data() + at, nearness.data() + at, stride_);
  }
}

}  // namespace engine
