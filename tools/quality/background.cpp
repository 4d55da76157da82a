#include "tools/quality/background.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "engine/core/constants.h"
#include "engine/core/contract.h"

namespace quality {
namespace {

// What rounding to whole numbers adds to a variance, where the noise is not much smaller.
constexpr double kRounding_dn2 = 1.0 / 12.0;
// Of a large frame's tiles a row in four tells enough: 240 differences, 13 % of their variance. A
// small frame needs small tiles, to have any beside the target, and all their rows.
constexpr int kLargeTile_px = 32;
constexpr int kLargeStep = 4;
constexpr int kSmallTile_px = 16;
constexpr std::int64_t kSmallFrame_px = 262'144;  // 512 x 512
// Share of all tiles that have the level of the darkest.
constexpr double kEvenShare = 1.0 / 7.0;
// A rough tile's exact roughness does not matter; that its squares fit in 32 bits does.
constexpr std::int32_t kMostDifference_dn = 8191;
// Of variances, between the Earth's dim and bright parts.
constexpr double kQuietTimes = 3.0;
// Of those of one background: 1.4 is three sigma of a tile's own uncertainty above its lower
// quartile; of noise so low that few pixels differ, their number scatters.
constexpr double kEvenTimes = 1.4;
constexpr double kScatterOfFew_dn2 = 3.0 / 15.5;  // of 240: three over its root

// Where a line of quantiles looks: about the median, this share of all and so much more.
constexpr double kMiddle = 0.95;
constexpr std::size_t kMargin_dn = 4;

double normal_density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * engine::kPi); }

/// The z below which a share p in (0, 1) of a normal distribution is. Winitzki's approximation of
/// the inverse error function, within 0.002 of it, and two steps of Newton's.
double normal_quantile(double p) {
  constexpr double kA = 0.147;
  const double x = 2.0 * p - 1.0;
  const double l = std::log(4.0 * p * (1.0 - p));
  const double b = 2.0 / (engine::kPi * kA) + 0.5 * l;
  double z = std::copysign(std::sqrt(2.0 * (std::sqrt(b * b - l / kA) - b)), x);
  for (int i = 0; i < 2; ++i) z -= (0.5 * std::erfc(-z / std::sqrt(2.0)) - p) / normal_density(z);
  return z;
}

/// A weighted straight line y = a + b x, by its sums.
struct Line {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  int points = 0;

  void add(double x, double y, double weight) {
    w += weight;
    wx += weight * x;
    wy += weight * y;
    wxx += weight * x * x;
    wxy += weight * x * y;
    ++points;
  }
  [[nodiscard]] double slope() const { return (w * wxy - wx * wy) / (w * wxx - wx * wx); }
  [[nodiscard]] double zero() const { return (wx - wy / slope()) / w; }
};

/// A stretch of counts about the median, and all that is below.
struct Middle {
  std::size_t median = 0;
  std::size_t first = 0;
  std::size_t last = 0;
  double total = 0;
  double below_first = 0;
};

Middle middle_of(std::span<const std::uint32_t> counts) {
  Middle m;
  m.total = std::accumulate(counts.begin(), counts.end(), 0.0);
  for (double below = counts[0]; 2.0 * below < m.total; below += counts[++m.median]) {
  }
  m.first = m.last = m.median;
  for (double inside = counts[m.median]; inside < kMiddle * m.total;) {
    if (m.first > 0) inside += counts[--m.first];
    if (m.last + 1 < counts.size()) inside += counts[++m.last];
  }
  m.first = m.first > kMargin_dn ? m.first - kMargin_dn : 0;
  m.last = std::min(m.last + kMargin_dn, counts.size() - 1);
  m.below_first =
      std::accumulate(counts.begin(), counts.begin() + static_cast<std::ptrdiff_t>(m.first), 0.0);
  return m;
}

/// Which borders between DN a line is laid through.
struct Borders {
  double least_z = 0;
  double most_z = 0;
  bool uncrossed = false;  ///< the lowest that few have crossed, too
};

/// The quantiles there. A border that few have crossed says little: nothing, or that half of one
/// might have.
Line quantile_line(std::span<const std::uint32_t> counts, const Middle& m, const Borders& borders) {
  constexpr double kFew = 10.0;
  Line line;
  double below = m.below_first;
  // Wide noise has more borders than a line needs.
  const std::size_t step = std::max<std::size_t>(1, (m.last - m.first) / 256);
  for (std::size_t dn = m.first; dn <= m.last; ++dn) {
    below += counts[dn];
    const bool lowest = below < kFew && dn + 1 < counts.size() && below + counts[dn + 1] >= kFew;
    const bool told = below >= kFew && m.total - below >= kFew && (dn - m.first) % step == 0;
    if (!told && !(borders.uncrossed && lowest)) continue;
    const double p = std::max(below, 0.5) / m.total;
    const double z = normal_quantile(p);
    if (z < borders.least_z || z > borders.most_z) continue;
    const double density = normal_density(z);
    line.add(static_cast<double>(dn) + 0.5, z, density * density / (p * (1.0 - p)));
  }
  return line;
}

/// Where two DN have nearly all, the borders beyond them are so far that nothing crosses: no more
/// than half of one.
Rounded narrow(std::span<const std::uint32_t> counts, const Middle& m) {
  const auto median = static_cast<double>(m.median);
  const double above = m.median + 1 < counts.size() ? counts[m.median + 1] : 0.0;
  const double below = m.median > 0 ? counts[m.median - 1] : 0.0;
  const double other = std::max(above, below);
  if (other < 1.0) return {median, std::nullopt};
  const double pair = counts[m.median] + other;
  const double uncrossed = -normal_quantile(0.5 / pair);
  // From the border between the two to the one beyond the median, in sigmas.
  const double shared = -normal_quantile(other / pair);
  const double sigma_dn = 1.0 / (uncrossed + shared);
  const double from_median_dn = 0.5 - shared * sigma_dn;
  return {median + (above >= below ? from_median_dn : -from_median_dn), sigma_dn};
}

}  // namespace

Rounded fit_rounded_normal(std::span<const std::uint32_t> count_of_dn) noexcept {
  if (std::ranges::all_of(count_of_dn, [](std::uint32_t n) { return n == 0; })) return {};
  const Middle m = middle_of(count_of_dn);
  const auto median = static_cast<double>(m.median);
  const auto fitted = [&](const Borders& borders) -> Rounded {
    const Line line = quantile_line(count_of_dn, m, borders);
    if (line.points < 2 || !(line.slope() > 0.0)) return {median, std::nullopt};
    const Rounded fit{line.zero(), 1.0 / line.slope()};
    // A tail that is no normal distribution's puts the mean elsewhere.
    if (std::abs(fit.mean_dn - median) > 0.5 + 0.3 * *fit.sigma_dn) return {median, std::nullopt};
    return fit;
  };
  // The dark side of the middle, if noise is wider than a DN: light that is no background is on the
  // other.
  if (const Rounded wide = fitted({-2.0, 0.7, false}); wide.sigma_dn) return wide;
  // Narrower noise needs what tails there are. Light widens that of both sides, and the dark one
  // alone, of few pixels or of a border that none has crossed, is a bound.
  constexpr double kSureOfBound = 1.15;
  const Rounded dark = fitted({-6.0, 0.7, true});
  const Rounded both = fitted({-4.0, 4.0, false});
  if (dark.sigma_dn && !(both.sigma_dn && *both.sigma_dn < kSureOfBound * *dark.sigma_dn))
    return dark;
  return both.sigma_dn ? both : narrow(count_of_dn, m);
}

BackgroundMeter::BackgroundMeter(int largest_width_px, int largest_height_px)
    : count_of_dn_(65536) {
  const auto tiles = [&](int size_px) {
    return static_cast<std::size_t>((largest_width_px + size_px - 1) / size_px) *
           static_cast<std::size_t>((largest_height_px + size_px - 1) / size_px);
  };
  // A small frame has few pixels, but may be long.
  const auto most_small = static_cast<std::size_t>(kSmallFrame_px / kSmallTile_px);
  tiles_.resize(std::max(tiles(kLargeTile_px), std::min(most_small, tiles(kSmallTile_px))));
  sorted_.resize(std::max<std::size_t>(9, tiles_.size()));
}

double BackgroundMeter::variance_dn2() const noexcept {
  const double sigma = sigma_dn_.value_or(0.0);
  return sigma * sigma + kRounding_dn2;
}

void BackgroundMeter::measure(const engine::DnImage& frame) noexcept {
  cut(frame);
  fill_tiles(frame);
  find_quiet();
  if (even_) {
    fit_even(frame);
  } else {
    spread_uneven();
  }
}

BackgroundMeter::Tile BackgroundMeter::tile_of(const engine::DnImage& frame,
                                               const engine::PixelRect& box) const noexcept {
  std::uint64_t level = 0;
  std::uint64_t square = 0;
  int rows = 0;
  const auto n = static_cast<std::size_t>(box.width());
  for (int v = box.top; v < box.bottom; v += row_step_, ++rows) {
    const std::uint16_t* p = frame.row(v).data() + box.left;
    std::uint32_t row_level = 0;
    std::uint32_t row_square = 0;
    for (std::size_t i = 0; i < n; ++i) row_level += p[i];
    for (std::size_t i = 0; i + 2 < n; ++i) {
      const std::int32_t bend = p[i] - 2 * p[i + 1] + p[i + 2];
      const std::int32_t kept = std::min(std::abs(bend), kMostDifference_dn);
      row_square += static_cast<std::uint32_t>(kept * kept);
    }
    level += row_level;
    square += row_square;
  }
  Tile tile;
  tile.level_dn = static_cast<double>(level) / (rows * static_cast<double>(n));
  // Of white noise a second difference has six times the variance. The last tile of a row may be
  // too narrow for any: that it is even is not known.
  tile.rough_dn2 = n < 3 ? std::numeric_limits<double>::max()
                         : static_cast<double>(square) / (6.0 * rows * static_cast<double>(n - 2));
  return tile;
}

void BackgroundMeter::cut(const engine::DnImage& frame) noexcept {
  const bool small = std::int64_t{frame.width()} * frame.height() <= kSmallFrame_px;
  tile_px_ = small ? kSmallTile_px : kLargeTile_px;
  row_step_ = small ? 1 : kLargeStep;
  columns_ = static_cast<std::size_t>((frame.width() + tile_px_ - 1) / tile_px_);
  rows_ = static_cast<std::size_t>((frame.height() + tile_px_ - 1) / tile_px_);
  used_ = columns_ * rows_;
  ENSURE(used_ <= tiles_.size());
}

void BackgroundMeter::fill_tiles(const engine::DnImage& frame) noexcept {
  const engine::PixelRect whole{0, 0, frame.width(), frame.height()};
  for (std::size_t row = 0; row < rows_; ++row) {
    for (std::size_t column = 0; column < columns_; ++column) {
      const int left = static_cast<int>(column) * tile_px_;
      const int top = static_cast<int>(row) * tile_px_;
      const engine::PixelRect box{left, top, left + tile_px_, top + tile_px_};
      tiles_[row * columns_ + column] = tile_of(frame, box.clipped_to(whole));
    }
  }
}

void BackgroundMeter::find_quiet() noexcept {
  const auto sorted = std::span(sorted_).first(used_);
  const auto place = [](std::span<double> s, double share) {
    return s[static_cast<std::size_t>(share * static_cast<double>(s.size() - 1))];
  };
  for (std::size_t i = 0; i < used_; ++i) sorted[i] = tiles_[i].rough_dn2;
  std::sort(sorted.begin(), sorted.end());
  const double low_dn2 = place(sorted, 0.25);
  const double limit_dn2 = kQuietTimes * (low_dn2 + kRounding_dn2);
  even_limit_dn2_ = kEvenTimes * low_dn2 + kScatterOfFew_dn2 * std::sqrt(low_dn2);
  std::size_t quiet = 0;
  for (; quiet < used_ && sorted[quiet] <= limit_dn2; ++quiet) {
  }
  rough_dn2_ = place(sorted.first(quiet), 0.5);
  std::size_t n = 0;
  for (const Tile& tile : std::span(tiles_).first(used_))
    if (tile.rough_dn2 <= limit_dn2) sorted[n++] = tile.level_dn;
  const auto levels = sorted.first(n);
  std::sort(levels.begin(), levels.end());
  // Not the very darkest, which may be a dark column.
  level_dn_ = place(levels, 0.03);
  const double alike_dn = level_dn_ + near_dn();
  const auto alike = std::ranges::count_if(levels, [&](double level) { return level <= alike_dn; });
  even_ = static_cast<double>(alike) >= kEvenShare * static_cast<double>(used_);
  level_dn_ = place(even_ ? levels.first(static_cast<std::size_t>(alike)) : levels, 0.5);
}

double BackgroundMeter::near_dn() const noexcept {
  // A tile's mean of some 240 pixels is known to a fifteenth of their noise.
  return std::max(0.3, 0.4 * std::sqrt(rough_dn2_));
}

void BackgroundMeter::fit_even(const engine::DnImage& frame) noexcept {
  std::fill(count_of_dn_.begin(), count_of_dn_.end(), 0U);
  for (std::size_t i = 0; i < used_; ++i) {
    if (tiles_[i].rough_dn2 > even_limit_dn2_ ||
        std::abs(tiles_[i].level_dn - level_dn_) > near_dn())
      continue;
    const int left = static_cast<int>(i % columns_) * tile_px_;
    const int top = static_cast<int>(i / columns_) * tile_px_;
    const int right = std::min(left + tile_px_, frame.width());
    const int bottom = std::min(top + tile_px_, frame.height());
    for (int v = top; v < bottom; v += row_step_)
      for (int u = left; u < right; ++u) ++count_of_dn_[frame.at(u, v)];
  }
  const Rounded fit = fit_rounded_normal(count_of_dn_);
  level_dn_ = fit.mean_dn;
  sigma_dn_ = fit.sigma_dn;
  for (Tile& tile : std::span(tiles_).first(used_)) tile.background_dn = level_dn_;
}

void BackgroundMeter::spread_uneven() noexcept {
  sigma_dn_ = std::sqrt(std::max(0.0, rough_dn2_ - kRounding_dn2));
  for (std::size_t row = 0; row < rows_; ++row) {
    for (std::size_t column = 0; column < columns_; ++column) {
      std::size_t n = 0;
      for (std::size_t v = row > 0 ? row - 1 : 0; v < std::min(rows_, row + 2); ++v)
        for (std::size_t u = column > 0 ? column - 1 : 0; u < std::min(columns_, column + 2); ++u)
          sorted_[n++] = tiles_[v * columns_ + u].level_dn;
      std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(n));
      tiles_[row * columns_ + column].background_dn = sorted_[n / 2];
    }
  }
}

}  // namespace quality
