#include "hil/faults/pixel_faults.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace hil {

using engine::DnImage;

namespace {

std::uint16_t brighter(std::uint16_t pixel, int dn, int full_scale) noexcept {
  // A pixel that is brighter than it can be stays so.
  return static_cast<std::uint16_t>(std::max<int>(pixel, std::min(pixel + dn, full_scale)));
}

/// Makes rows [begin, end) of a column as bright as can be; returns how many were not.
std::int64_t fill(int column, int begin, int end, int full_scale, DnImage& image) noexcept {
  std::int64_t changed = 0;
  for (int v = begin; v < end; ++v) {
    std::uint16_t& pixel = image.at(column, v);
    if (pixel >= full_scale) continue;
    pixel = static_cast<std::uint16_t>(full_scale);
    ++changed;
  }
  return changed;
}

}  // namespace

RayTrack add_ray(engine::Draws& draws, double mean_length_px, double mean_dn, int full_scale,
                 DnImage& image) noexcept {
  double u = draws.uniform_double() * image.width();
  double v = draws.uniform_double() * image.height();
  const double angle = 2.0 * engine::kPi * draws.uniform_double();
  const double length_px = -mean_length_px * std::log(draws.uniform_double());
  const double dn = std::max(1.0, -mean_dn * std::log(draws.uniform_double()));
  const int dn_each = static_cast<int>(std::min(dn, 65535.0));

  // One pixel a step along the longer axis: no pixel is met twice.
  const double longer = std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
  const double du = std::cos(angle) / longer;
  const double dv = std::sin(angle) / longer;
  const double most = std::min(length_px * longer, 1e5);
  RayTrack track;
  for (int i = 0; i <= static_cast<int>(most); ++i, u += du, v += dv) {
    const int column = static_cast<int>(std::floor(u));
    const int row = static_cast<int>(std::floor(v));
    if (column < 0 || row < 0 || column >= image.width() || row >= image.height()) break;
    if (i == 0) track.start = static_cast<std::int64_t>(row) * image.width() + column;
    std::uint16_t& pixel = image.at(column, row);
    const std::uint16_t after = brighter(pixel, dn_each, full_scale);
    track.added_dn += after - pixel;
    pixel = after;
    ++track.pixels;
  }
  return track;
}

std::int64_t Bloom::look(const DnImage& image, int full_scale) noexcept {
  std::fill(bright_.begin(), bright_.end(), std::uint8_t{0});
  std::int64_t count = 0;
  for (int v = 0; v < image.height(); ++v) {
    const auto row = image.row(v);
    // Most rows have none, and are over in a blink.
    if (*std::max_element(row.begin(), row.end()) < full_scale) continue;
    for (std::size_t u = 0; u < row.size(); ++u) {
      if (row[u] < full_scale) continue;
      bright_[u] = 1;
      ++count;
    }
  }
  return count;
}

std::int64_t Bloom::apply(double bleed, int full_scale, DnImage& image) noexcept {
  const int height = image.height();
  std::int64_t changed = 0;
  for (int u = 0; u < image.width(); ++u) {
    if (bright_[static_cast<std::size_t>(u)] == 0) continue;
    int wet_until = 0;  // what the runs above fill, downwards
    for (int v = 0; v < height;) {
      if (image.at(u, v) < full_scale) {
        if (v < wet_until) changed += fill(u, v, v + 1, full_scale, image);
        ++v;
        continue;
      }
      const int begin = v;
      while (v < height && image.at(u, v) >= full_scale) ++v;
      const int reach = static_cast<int>(
          std::min(std::ceil(bleed * static_cast<double>(v - begin)), static_cast<double>(height)));
      changed += fill(u, std::max(0, begin - reach), begin, full_scale, image);
      wet_until = std::max(wet_until, std::min(v + reach, height));
    }
  }
  return changed;
}

std::int64_t heat_column(int column, int dn, int full_scale, DnImage& image) noexcept {
  std::int64_t changed = 0;
  for (int v = 0; v < image.height(); ++v) {
    std::uint16_t& pixel = image.at(column, v);
    const std::uint16_t after = brighter(pixel, dn, full_scale);
    changed += after != pixel ? 1 : 0;
    pixel = after;
  }
  return changed;
}

std::int64_t stick_column(int column, int dn, DnImage& image) noexcept {
  std::int64_t changed = 0;
  for (int v = 0; v < image.height(); ++v) {
    std::uint16_t& pixel = image.at(column, v);
    changed += pixel != dn ? 1 : 0;
    pixel = static_cast<std::uint16_t>(dn);
  }
  return changed;
}

BitFlips::BitFlips(engine::Draws& draws, double rate, std::int64_t bits) noexcept
    : draws_(draws), log_of_good_(std::log1p(-rate)), end_(bits) {}

std::int64_t BitFlips::next() noexcept {
  const double gap = std::floor(std::log(draws_.uniform_double()) / log_of_good_);
  // At small rates a gap may be longer than a number of bits can say.
  if (!(gap < static_cast<double>(end_ - at_ - 1))) {
    at_ = end_ - 1;
    return -1;
  }
  at_ += 1 + static_cast<std::int64_t>(gap);
  return at_;
}

}  // namespace hil
