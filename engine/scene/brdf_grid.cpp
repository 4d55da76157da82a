#include "engine/scene/brdf_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/surface_frame.h"

namespace engine {
namespace {

using Eigen::Vector3d;

std::string text_of(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

/// Both sides of the plane of incidence on one.
double one_side_deg(ScatterAngles angles, double second_deg) {
  const double turned = std::abs(second_deg);
  return angles == ScatterAngles::kPolar && turned > 180.0 ? 360.0 - turned : turned;
}

/// From the mirror direction to the horizon, in projection, for the cosine and sine of the azimuth
/// about it.
double to_horizon(double sin_in, double cos_turn, double sin_turn) noexcept {
  const double across = sin_in * sin_turn;
  return std::sqrt(std::max(0.0, 1.0 - across * across)) - sin_in * cos_turn;
}

struct Bracket {
  std::size_t low = 0;
  double part = 0;  ///< of the next
};
/// Beyond the ends: the end.
Bracket bracket_of(const std::vector<double>& rising, double x) noexcept {
  if (rising.size() < 2 || !(x > rising.front())) return {};
  const auto above = std::upper_bound(rising.begin() + 1, rising.end() - 1, x);
  const auto low = static_cast<std::size_t>(above - rising.begin()) - 1;
  return {low, std::min(1.0, (x - rising[low]) / (rising[low + 1] - rising[low]))};
}

/// Between values that are given by their logarithms: a lobe falls by factors.
template <std::size_t kCorners>
double exponential_of(const std::array<double, kCorners>& weights,
                      const std::array<double, kCorners>& logarithms) noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < kCorners; ++i) sum += weights[i] * logarithms[i];
  return std::exp(sum);
}

/// Readings of 0, which stand for something below what could be seen: half of the least above it.
void lift_from_zero(std::vector<double>& values, double least_of_all) {
  double least = std::numeric_limits<double>::infinity();
  for (const double v : values)
    if (v > 0.0) least = std::min(least, v);
  const double floor = 0.5 * std::min(least, std::isfinite(least) ? least : least_of_all);
  // Of the smallest numbers there are, a half is 0.
  for (double& v : values)
    if (!(v > 0.0)) v = std::max(floor, std::numeric_limits<double>::min());
}

/// Even over the disc, so over the hemisphere by the cosine.
Vector3d even_direction(std::size_t i, std::size_t count) noexcept {
  constexpr double kGoldenTurn = 2.399963229728653;
  const double r2 = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
  const double turn = kGoldenTurn * static_cast<double>(i);
  const double r = std::sqrt(r2);
  return {r * std::cos(turn), r * std::sin(turn), std::sqrt(1.0 - r2)};
}

}  // namespace

/// The points of one incidence, by their angles.
struct BrdfGrid::Readings {
  struct Reading {
    std::array<double, 2> sides{};  ///< 1/sr
    std::array<int, 2> lines{};     ///< 0: none
  };
  std::map<double, std::map<double, Reading>> by_first_deg;
  double left_right_sum2 = 0;
  std::size_t pairs = 0;

  void add(const BrdfPoints& points, const BrdfPoint& p) {
    const bool polar = points.angles == ScatterAngles::kPolar;
    const double second_deg = one_side_deg(points.angles, p.second_deg);
    const bool other = p.second_deg < 0.0 || (polar && p.second_deg > 180.0);
    Reading& reading = by_first_deg[p.first_deg][second_deg];
    const std::size_t side = other ? 1 : 0;
    if (reading.lines[side] != 0)
      points.fail(p.line, "has the angles of line " + std::to_string(reading.lines[side]));
    reading.sides[side] = p.brdf_per_sr;
    reading.lines[side] = p.line;
  }
  /// One value for both sides.
  double value(const Reading& reading) {
    if (reading.lines[0] == 0 || reading.lines[1] == 0)
      return reading.sides[reading.lines[0] == 0 ? 1 : 0];
    const double sum = reading.sides[0] + reading.sides[1];
    if (sum > 0.0) {
      left_right_sum2 += std::pow((reading.sides[0] - reading.sides[1]) / sum, 2);
      ++pairs;
    }
    return 0.5 * sum;
  }
};

BrdfGrid::BrdfGrid(const BrdfPoints& points) {
  std::map<double, Readings> by_incidence;
  double least = std::numeric_limits<double>::infinity();
  for (const BrdfPoint& p : points.points) {
    by_incidence[p.theta_in_deg].add(points, p);
    if (p.brdf_per_sr > 0.0) least = std::min(least, p.brdf_per_sr);
  }
  const int first_line = points.points.front().line;
  if (by_incidence.size() < 2)
    points.fail(first_line,
                "has the one theta_in_deg of the table: two are needed to know how the lobe moves");
  if (!std::isfinite(least))
    points.fail(first_line, "and all others have no light: brdf_per_sr is 0");
  double sum2 = 0;
  std::size_t pairs = 0;
  for (auto& [theta_in_deg, readings] : by_incidence) {
    Scan scan = scan_of(points, readings);
    scan.theta_in_rad = theta_in_deg * kDegree;
    scan.sin_in = std::sin(scan.theta_in_rad);
    scan.scale = 2.0 * std::cos(scan.theta_in_rad);
    lift_from_zero(scan.values, least);
    for (double& v : scan.values) v = std::log(v);
    measured_.push_back({scan.theta_in_rad, coverage_of(scan), lobe_aside_of(scan)});
    scans_.push_back(std::move(scan));
    sum2 += readings.left_right_sum2;
    pairs += readings.pairs;
  }
  if (pairs > 0) left_right_rms_ = std::sqrt(sum2 / static_cast<double>(pairs));
  Scan normal = normal_of(scans_.front());
  if (scans_.front().theta_in_rad > 0.0) {
    scans_.insert(scans_.begin(), std::move(normal));
  } else if (scans_.front().angles == ScatterAngles::kPlanes) {
    scans_.front() = std::move(normal);
  }
}

BrdfGrid::Scan BrdfGrid::scan_of(const BrdfPoints& points, Readings& readings) {
  const bool polar = points.angles == ScatterAngles::kPolar;
  const auto& rows = readings.by_first_deg;
  const auto any_line = [](const Readings::Reading& r) { return std::max(r.lines[0], r.lines[1]); };
  const int line = any_line(rows.begin()->second.begin()->second);
  const double theta_in_deg =
      std::ranges::find(points.points, line, &BrdfPoint::line)->theta_in_deg;
  const std::string where = "at theta_in_deg " + text_of(theta_in_deg);
  // The normal itself has no azimuth: one reading serves all.
  const auto is_pole = [&](double first_deg) { return polar && first_deg == 0.0; };
  std::map<double, bool> seconds;
  for (const auto& [first_deg, row] : rows)
    if (!is_pole(first_deg) || rows.size() == 1)
      for (const auto& [second_deg, reading] : row) seconds[second_deg] = true;
  if (rows.size() < 2)
    points.fail(line, where + " is one " + (polar ? "theta_out_deg" : "in_plane_deg") +
                          " alone: a grid has two at least");
  const bool normal = polar && theta_in_deg == 0.0;
  if (seconds.size() < 2 && !normal)
    points.fail(line, where + " is one " + (polar ? "azimuth_deg" : "out_of_plane_deg") +
                          " alone: cuts do not make a surface (starloop fit-brdf takes them)");
  Scan scan;
  scan.angles = points.angles;
  for (const auto& [second_deg, there] : seconds) scan.second_rad.push_back(second_deg * kDegree);
  for (const auto& [first_deg, row] : rows) {
    scan.first_rad.push_back(first_deg * kDegree);
    std::vector<double> values;
    const bool one_value = normal || is_pole(first_deg);
    double mean = 0;
    if (one_value) {
      for (const auto& [second_deg, reading] : row) mean += readings.value(reading);
      mean /= static_cast<double>(row.size());
    }
    for (const auto& [second_deg, there] : seconds) {
      const auto it = row.find(second_deg);
      if (it == row.end() && !is_pole(first_deg))
        points.fail(any_line(row.begin()->second),
                    "is in a row with a hole: " + where + " there is no point at " +
                        (polar ? "theta_out_deg " : "in_plane_deg ") + text_of(first_deg) +
                        (polar ? ", azimuth_deg " : ", out_of_plane_deg ") + text_of(second_deg));
      values.push_back(one_value ? mean : readings.value(it->second));
    }
    scan.values.insert(scan.values.end(), values.begin(), values.end());
  }
  return scan;
}

Vector3d BrdfGrid::angles_of(ScatterAngles angles, const Vector3d& out) noexcept {
  if (angles == ScatterAngles::kPolar)
    return {std::atan2(std::hypot(out.x(), out.y()), out.z()),
            std::atan2(std::abs(out.y()), out.x()), 0.0};
  return {std::atan2(out.x(), out.z()), std::atan2(std::abs(out.y()), std::hypot(out.x(), out.z())),
          0.0};
}

double BrdfGrid::Scan::value(const Vector3d& out) const noexcept {
  const Vector3d place = angles_of(angles, out);
  const Bracket row = bracket_of(first_rad, place.x());
  const Bracket column = bracket_of(second_rad, place.y());
  const std::size_t columns = second_rad.size();
  const std::size_t right = columns > 1 ? 1 : 0;
  const double* low = values.data() + row.low * columns + column.low;
  const double* high = low + columns;
  return exponential_of<4>({(1.0 - row.part) * (1.0 - column.part), (1.0 - row.part) * column.part,
                            row.part * (1.0 - column.part), row.part * column.part},
                           {low[0], low[right], high[0], high[right]});
}

bool BrdfGrid::Scan::reaches(const Vector3d& out) const noexcept {
  const auto within = [](const std::vector<double>& range, double x) {
    constexpr double kRounding_rad = 1e-9;
    return x >= range.front() - kRounding_rad && x <= range.back() + kRounding_rad;
  };
  const Vector3d place = angles_of(angles, out);
  const bool all_round = theta_in_rad == 0.0 && second_rad.size() == 1;
  return within(first_rad, place.x()) && (all_round || within(second_rad, place.y()));
}

BrdfGrid::Place BrdfGrid::place_of(double sin_in, double scale, double dx, double dy) noexcept {
  const double distance = std::hypot(dx, dy);
  Place place;
  if (distance > 0.0) {
    place.cos_turn = dx / distance;
    place.sin_turn = dy / distance;
  }
  const double horizon = to_horizon(sin_in, place.cos_turn, place.sin_turn);
  place.nearness = distance > 0.0 ? std::max(0.0, scale / distance - scale / horizon)
                                  : std::numeric_limits<double>::infinity();
  return place;
}

Vector3d BrdfGrid::direction_at(double sin_in, double scale, const Place& place) noexcept {
  const double horizon = to_horizon(sin_in, place.cos_turn, place.sin_turn);
  const double distance = scale / (place.nearness + scale / horizon);
  const double x = sin_in + distance * place.cos_turn;
  const double y = distance * place.sin_turn;
  return {x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y))};
}

double BrdfGrid::at_place(const Scan& scan, const Place& place) noexcept {
  return scan.value(direction_at(scan.sin_in, scan.scale, place));
}

Vector3d BrdfGrid::carried(double from_in_rad, const Vector3d& out,
                           double to_in_rad) const noexcept {
  const auto scale = [&](double theta_rad) {
    return 2.0 * std::cos(std::clamp(theta_rad, measured_.front().theta_in_rad,
                                     measured_.back().theta_in_rad));
  };
  const double sin_from = std::sin(from_in_rad);
  const Place place = place_of(sin_from, scale(from_in_rad), out.x() - sin_from, std::abs(out.y()));
  return direction_at(std::sin(to_in_rad), scale(to_in_rad), place);
}

/// A grid of one azimuth. Where a table is measured next to the plane of incidence alone, azimuths
/// across have none but its edge, which is the flank of a lobe and no part of it far out: they do
/// not count where others were measured, and where none were the last mean holds.
BrdfGrid::Scan BrdfGrid::normal_of(const Scan& first) {
  constexpr int kNodes = 1024;
  constexpr int kTurns = 64;
  Scan normal;
  normal.scale = first.scale;
  normal.angles = ScatterAngles::kPolar;
  normal.second_rad = {0.0};
  double last = 0;
  for (int node = 0; node <= kNodes; ++node) {
    // Closest where lobes are narrow.
    const double part = static_cast<double>(node) / kNodes;
    const double theta_rad = 0.5 * kPi * part * part;
    double sum = 0;
    double sum_of_all = 0;
    int measured = 0;
    for (int turn = 0; turn <= kTurns; ++turn) {
      const double azimuth = kPi * turn / kTurns;
      const double d = std::sin(theta_rad);
      const Place place = place_of(0.0, first.scale, d * std::cos(azimuth), d * std::sin(azimuth));
      const Vector3d out = direction_at(first.sin_in, first.scale, place);
      const double value = first.value(out);
      sum_of_all += value;
      if (!first.reaches(out)) continue;
      sum += value;
      ++measured;
    }
    if (measured > 0) {
      last = sum / measured;
    } else if (last == 0.0) {
      last = sum_of_all / (kTurns + 1);
    }
    normal.first_rad.push_back(theta_rad);
    normal.values.push_back(std::log(std::max(last, std::numeric_limits<double>::min())));
  }
  return normal;
}

double BrdfGrid::at(const Vector3d& in, const Vector3d& out) const noexcept {
  // x forward, to the side of the mirror direction. Normal light has no such side: it takes the
  // direction across, where what is more forward and less backward cancels.
  const double sin_in = std::hypot(in.x(), in.y());
  const double sin_out = std::hypot(out.x(), out.y());
  double forward_x = 1.0;
  double forward_y = 0.0;
  if (sin_in > 0.0) {
    forward_x = -in.x() / sin_in;
    forward_y = -in.y() / sin_in;
  } else if (sin_out > 0.0) {
    forward_x = out.y() / sin_out;
    forward_y = -out.x() / sin_out;
  }
  const double dx = out.x() * forward_x + out.y() * forward_y - sin_in;
  const double dy = std::abs(out.y() * forward_x - out.x() * forward_y);
  const double theta = std::atan2(sin_in, in.z());
  const auto above = std::upper_bound(
      scans_.begin(), scans_.end(), theta,
      [](double angle_rad, const Scan& scan) { return angle_rad < scan.theta_in_rad; });
  const bool held = above == scans_.end();
  const Scan& low = *(above - 1);
  // Normal light has its width from the first incidence.
  const double scale = held || low.scale == above->scale ? low.scale : 2.0 * in.z();
  const Place place = place_of(sin_in, scale, dx, dy);
  const double from_low = at_place(low, place);
  if (held) return from_low;
  const double part = (theta - low.theta_in_rad) / (above->theta_in_rad - low.theta_in_rad);
  return exponential_of<2>({1.0 - part, part},
                           {std::log(from_low), std::log(at_place(*above, place))});
}

double BrdfGrid::coverage_of(const Scan& scan) noexcept {
  constexpr std::size_t kDirections = 4096;
  std::size_t inside = 0;
  for (std::size_t k = 0; k < kDirections; ++k)
    if (scan.reaches(even_direction(k, kDirections))) ++inside;
  return static_cast<double>(inside) / kDirections;
}

std::optional<Vector3d> BrdfGrid::lobe_aside_of(const Scan& scan) {
  constexpr double kAside = 0.015192246987791981;  // 1 - cos 10 deg
  std::vector<double> sorted = scan.values;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  double brightest = *middle + std::log(3.0);
  const Vector3d mirror = mirrored(incident_direction(scan.theta_in_rad));
  const std::size_t columns = scan.second_rad.size();
  const auto passed = [&](std::size_t row, std::size_t column) {
    const double value = scan.values[row * columns + column];
    for (std::size_t i = row - std::min<std::size_t>(row, 1);
         i <= std::min(row + 1, scan.first_rad.size() - 1); ++i)
      for (std::size_t k = column - std::min<std::size_t>(column, 1);
           k <= std::min(column + 1, columns - 1); ++k)
        if (scan.values[i * columns + k] > value) return true;
    return false;
  };
  std::optional<Vector3d> aside;
  for (std::size_t row = 0; row < scan.first_rad.size(); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      if (!(scan.values[row * columns + column] > brightest) || passed(row, column)) continue;
      const Vector3d out =
          scatter_direction(scan.angles, scan.first_rad[row], scan.second_rad[column]);
      if (out.z() <= kGrazing || one_minus_cos(mirror, out) < kAside) continue;
      brightest = scan.values[row * columns + column];
      aside = out;
    }
  }
  return aside;
}

}  // namespace engine
