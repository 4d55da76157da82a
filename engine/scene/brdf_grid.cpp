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

/// Between values that are given by their logarithms: a lobe falls by factors. Where one of them is
/// 0 the values themselves are weighed.
template <std::size_t kCorners>
double exponential_of(const std::array<double, kCorners>& weights,
                      const std::array<double, kCorners>& logarithms) noexcept {
  constexpr double kOfNothing = -std::numeric_limits<double>::infinity();
  double sum = 0;
  if (std::ranges::find(logarithms, kOfNothing) == logarithms.end()) {
    for (std::size_t i = 0; i < kCorners; ++i) sum += weights[i] * logarithms[i];
    return std::exp(sum);
  }
  for (std::size_t i = 0; i < kCorners; ++i) sum += weights[i] * std::exp(logarithms[i]);
  return sum;
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
  double brightest = 0;
  for (const BrdfPoint& p : points.points) {
    by_incidence[p.theta_in_deg].add(points, p);
    brightest = std::max(brightest, p.brdf_per_sr);
  }
  const int first_line = points.points.front().line;
  if (by_incidence.size() < 2)
    points.fail(first_line,
                "has the one theta_in_deg of the table: two are needed to know how the lobe moves");
  if (!(brightest > 0.0)) points.fail(first_line, "and all others have no light: brdf_per_sr is 0");
  double sum2 = 0;
  std::size_t pairs = 0;
  for (auto& [theta_in_deg, readings] : by_incidence) {
    Scan scan = scan_of(points, readings);
    scan.theta_in_rad = theta_in_deg * kDegree;
    scan.sin_in = std::sin(scan.theta_in_rad);
    scan.scale = 2.0 * std::cos(scan.theta_in_rad);
    scans_.push_back(std::move(scan));
    sum2 += readings.left_right_sum2;
    pairs += readings.pairs;
  }
  if (pairs > 0) left_right_rms_ = std::sqrt(sum2 / static_cast<double>(pairs));
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
      values.push_back(std::log(one_value ? mean : readings.value(it->second)));
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

double BrdfGrid::at_place(const Scan& scan, const Place& place) noexcept {
  const double horizon = to_horizon(scan.sin_in, place.cos_turn, place.sin_turn);
  const double distance = scan.scale / (place.nearness + scan.scale / horizon);
  const double x = scan.sin_in + distance * place.cos_turn;
  const double y = distance * place.sin_turn;
  return scan.value({x, y, std::sqrt(std::max(0.0, 1.0 - x * x - y * y))});
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
  const double distance = std::hypot(dx, dy);
  Place place;
  if (distance > 0.0) {
    place.cos_turn = dx / distance;
    place.sin_turn = dy / distance;
  }
  const double theta = std::atan2(sin_in, in.z());
  const auto above = std::upper_bound(
      scans_.begin(), scans_.end(), theta,
      [](double angle_rad, const Scan& scan) { return angle_rad < scan.theta_in_rad; });
  const bool held = above == scans_.begin() || above == scans_.end();
  const Scan& low = above == scans_.begin() ? scans_.front() : *(above - 1);
  const double scale = held ? low.scale : 2.0 * in.z();
  const double horizon = to_horizon(sin_in, place.cos_turn, place.sin_turn);
  place.nearness = distance > 0.0 ? std::max(0.0, scale / distance - scale / horizon)
                                  : std::numeric_limits<double>::infinity();
  const double from_low = at_place(low, place);
  if (held) return from_low;
  const double part = (theta - low.theta_in_rad) / (above->theta_in_rad - low.theta_in_rad);
  return exponential_of<2>({1.0 - part, part},
                           {std::log(from_low), std::log(at_place(*above, place))});
}

double BrdfGrid::coverage(std::size_t i) const noexcept {
  constexpr std::size_t kDirections = 4096;
  const Scan& scan = scans_[i];
  const auto within = [](const std::vector<double>& range, double x) {
    constexpr double kRounding_rad = 1e-9;
    return x >= range.front() - kRounding_rad && x <= range.back() + kRounding_rad;
  };
  std::size_t inside = 0;
  for (std::size_t k = 0; k < kDirections; ++k) {
    const Vector3d place = angles_of(scan.angles, even_direction(k, kDirections));
    const bool all_round = scan.theta_in_rad == 0.0 && scan.second_rad.size() == 1;
    if (within(scan.first_rad, place.x()) && (all_round || within(scan.second_rad, place.y())))
      ++inside;
  }
  return static_cast<double>(inside) / kDirections;
}

}  // namespace engine
