#include "engine/scene/star_zones.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr double kHeight_rad = kPi / StarZones::kZones;
// Rounding must not lose a star on an edge.
constexpr double kSlack_rad = 1e-9;

double turn(double angle_rad) noexcept {
  const double t = std::fmod(angle_rad, 2.0 * kPi);
  return t < 0.0 ? t + 2.0 * kPi : t;
}

}  // namespace

StarZones::StarZones() {
  for (int zone = 0; zone < kZones; ++zone) {
    const double middle = (zone + 0.5) * kHeight_rad - 0.5 * kPi;
    const auto cells = static_cast<std::size_t>(
        std::max(1.0, std::floor(kCellsAtEquator * std::cos(middle) + 0.5)));
    const auto z = static_cast<std::size_t>(zone);
    first_[z + 1] = first_[z] + cells;
  }
}

StarZones::Cell StarZones::cell(std::size_t index) const noexcept {
  const auto after = std::upper_bound(first_.begin(), first_.end(), index);
  const auto zone = static_cast<int>(after - first_.begin()) - 1;
  const double width = 2.0 * kPi / cells_of(zone);
  const auto column = static_cast<double>(index - first_[static_cast<std::size_t>(zone)]);
  return {column * width, zone * kHeight_rad - 0.5 * kPi, width, kHeight_rad};
}

std::size_t StarZones::index_of(const Eigen::Vector3d& unit) const noexcept {
  const double dec = std::asin(std::clamp(unit.z(), -1.0, 1.0));
  const int zone = std::clamp(static_cast<int>((dec + 0.5 * kPi) / kHeight_rad), 0, kZones - 1);
  const int cells = cells_of(zone);
  const double across = turn(std::atan2(unit.y(), unit.x())) / (2.0 * kPi) * cells;
  const int column = std::clamp(static_cast<int>(across), 0, cells - 1);
  return first_[static_cast<std::size_t>(zone)] + static_cast<std::size_t>(column);
}

StarZones::Reach::Reach(const Eigen::Vector3d& centre, double radius)
    : ra_rad(std::atan2(centre.y(), centre.x())),
      dec_rad(std::asin(std::clamp(centre.z(), -1.0, 1.0))),
      radius_rad(radius + kSlack_rad) {}

StarZones::Run StarZones::run_of(int zone, const Reach& reach) const noexcept {
  const double south = zone * kHeight_rad - 0.5 * kPi;
  if (reach.dec_rad + reach.radius_rad < south ||
      reach.dec_rad - reach.radius_rad > south + kHeight_rad)
    return {};
  const std::size_t begin = first_[static_cast<std::size_t>(zone)];
  const int cells = cells_of(zone);
  const Run whole{{begin, begin + static_cast<std::size_t>(cells)}, {}};
  // A circle that has a pole in it has every right ascension; of any other the widest place is
  // where sin(width) = sin(radius) / cos(declination).
  const double to_pole = 0.5 * kPi - std::abs(reach.dec_rad);
  if (reach.radius_rad >= to_pole) return whole;
  const double half = std::asin(std::sin(reach.radius_rad) / std::cos(reach.dec_rad)) + kSlack_rad;
  const double per_rad = cells / (2.0 * kPi);
  if (2.0 * half * per_rad + 1.0 >= cells) return whole;
  const auto left = static_cast<int>(turn(reach.ra_rad - half) * per_rad);
  const auto right = static_cast<int>(turn(reach.ra_rad + half) * per_rad);
  const auto at = [&](int column) {
    return begin + static_cast<std::size_t>(std::clamp(column, 0, cells));
  };
  if (left <= right) return {{at(left), at(right + 1)}, {}};
  return {{at(left), at(cells)}, {at(0), at(right + 1)}};
}

Eigen::Vector3d unit_at(double ra_rad, double dec_rad) noexcept {
  const double across = std::cos(dec_rad);
  return {across * std::cos(ra_rad), across * std::sin(ra_rad), std::sin(dec_rad)};
}

Eigen::Vector3d moved(const Eigen::Vector3d& unit, double motion_ra_rad_yr,
                      double motion_dec_rad_yr, double years) noexcept {
  const double ra = std::atan2(unit.y(), unit.x());
  const Eigen::Vector3d east(-std::sin(ra), std::cos(ra), 0.0);
  const Eigen::Vector3d north = unit.cross(east);
  return (unit + years * (motion_ra_rad_yr * east + motion_dec_rad_yr * north)).normalized();
}

}  // namespace engine
