#include "engine/render/light_parts.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

/// Third and fourth moments, or differences of such.
struct HighMoments {
  std::array<double, 4> third{};   // of x^3, x^2 y, x y^2, y^3
  std::array<double, 5> fourth{};  // of x^4, x^3 y, ...
  void add(double weight, double x, double y) noexcept {
    third[0] += weight * x * x * x;
    third[1] += weight * x * x * y;
    third[2] += weight * x * y * y;
    third[3] += weight * y * y * y;
    fourth[0] += weight * x * x * x * x;
    fourth[1] += weight * x * x * x * y;
    fourth[2] += weight * x * x * y * y;
    fourth[3] += weight * x * y * y * y;
    fourth[4] += weight * y * y * y * y;
  }
};

}  // namespace

double LightParts::Part::long_axis_rad() const noexcept {
  return 0.5 * std::atan2(2.0 * xy, xx - yy);
}

/// On the axes of the second moments: a pair on each.
std::array<LightSpot, LightParts::kPointsAPart> LightParts::Part::points() const noexcept {
  const double turn = long_axis_rad();
  const double mean = 0.5 * (xx + yy);
  const double half_difference = std::hypot(0.5 * (xx - yy), xy);
  // Two of four points at +-a have a second moment of a^2 / 2.
  const double a = std::sqrt(2.0 * (mean + half_difference));
  const double b = std::sqrt(2.0 * std::max(0.0, mean - half_difference));
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  const double each = 0.25 * light;
  return {{{x + a * c, y + a * s, each},
           {x - a * c, y - a * s, each},
           {x - b * s, y + b * c, each},
           {x + b * s, y - b * c, each}}};
}

LightParts::Part LightParts::part_of(std::span<const LightSpot> spots) noexcept {
  Part part;
  for (const LightSpot& spot : spots) {
    part.light += spot.light;
    part.x += spot.light * spot.x;
    part.y += spot.light * spot.y;
  }
  if (!(part.light > 0.0)) return {};
  part.x /= part.light;
  part.y /= part.light;
  for (const LightSpot& spot : spots) {
    const double dx = spot.x - part.x;
    const double dy = spot.y - part.y;
    part.xx += spot.light * dx * dx;
    part.xy += spot.light * dx * dy;
    part.yy += spot.light * dy * dy;
  }
  part.xx /= part.light;
  part.xy /= part.light;
  part.yy /= part.light;
  return part;
}

LightParts::Mismatch LightParts::mismatch_of(std::span<const LightSpot> spots,
                                             const Part& part) noexcept {
  HighMoments m;
  for (const LightSpot& spot : spots)
    m.add(spot.light / part.light, spot.x - part.x, spot.y - part.y);
  for (const LightSpot& point : part.points())
    m.add(-point.light / part.light, point.x - part.x, point.y - part.y);
  const auto& t = m.third;
  const auto& f = m.fourth;
  return {
      std::sqrt(t[0] * t[0] + 3.0 * (t[1] * t[1] + t[2] * t[2]) + t[3] * t[3]),
      std::sqrt(f[0] * f[0] + 4.0 * (f[1] * f[1] + f[3] * f[3]) + 6.0 * f[2] * f[2] + f[4] * f[4])};
}

void LightParts::cut(std::span<LightSpot> spots) noexcept {
  parts_ = {};
  mismatch_ = {};
  const auto dark = std::partition(spots.begin(), spots.end(),
                                   [](const LightSpot& spot) { return spot.light > 0.0; });
  const auto lit = spots.first(static_cast<std::size_t>(dark - spots.begin()));
  if (!lit.empty()) divide(lit, 0, 0);
}

/// A level is two cuts, the 4^level parts of which are kept.
void LightParts::divide(std::span<LightSpot> spots, int depth, std::size_t index) noexcept {
  const Part part = part_of(spots);
  if (!(part.light > 0.0)) return;
  if (depth % 2 == 0) {
    const auto level = static_cast<std::size_t>(depth / 2);
    parts_[level][index] = part;
    const Mismatch off = mismatch_of(spots, part);
    const double share = level == 0 ? 1.0 : part.light / light();
    mismatch_[level].third += share * off.third;
    mismatch_[level].fourth += share * off.fourth;
    if (level + 1 == parts_.size()) return;
  }
  const double c = std::cos(part.long_axis_rad());
  const double s = std::sin(part.long_axis_rad());
  const auto middle = std::partition(spots.begin(), spots.end(), [&](const LightSpot& spot) {
    return (spot.x - part.x) * c + (spot.y - part.y) * s < 0.0;
  });
  const auto first = static_cast<std::size_t>(middle - spots.begin());
  divide(spots.first(first), depth + 1, 2 * index);
  divide(spots.subspan(first), depth + 1, 2 * index + 1);
}

std::size_t LightParts::points(int level, Points& out) const noexcept {
  std::size_t count = 0;
  for (const Part& part : parts_[static_cast<std::size_t>(level)]) {
    if (!(part.light > 0.0)) continue;
    for (const LightSpot& point : part.points()) out[count++] = point;
  }
  return count;
}

}  // namespace engine
