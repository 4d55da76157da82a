#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/constants.h"
#include "engine/scene/brdf_points.h"

/// A goniometer that measures what it is told a surface does.
namespace test_support {

/// Degrees from `first` to `last`.
[[nodiscard]] inline std::vector<double> steps(double first, double last, double step) {
  std::vector<double> all;
  for (int i = 0; first + i * step <= last + 1e-9; ++i) all.push_back(first + i * step);
  return all;
}

/// As if read from a file: `f` of the directions of light and of scatter, in 1/sr.
template <class F>
void measure(engine::BrdfPoints& points, double theta_in_deg, double first_deg, double second_deg,
             const F& f) {
  engine::BrdfPoint point{static_cast<int>(points.points.size()) + 2, theta_in_deg, first_deg,
                          second_deg};
  point.brdf_per_sr =
      f(engine::incident_direction(point), engine::scatter_direction(points.angles, point));
  points.points.push_back(point);
}

/// Steps in both angles of scatter, finer about the mirror direction: what a goniometer is made to
/// do for a lobe a degree wide.
template <class F>
[[nodiscard]] engine::BrdfPoints scanned(const std::vector<double>& incidences_deg, const F& f) {
  engine::BrdfPoints points;
  points.path = "scan.csv";
  for (const double theta_in_deg : incidences_deg) {
    std::vector<double> in_plane = steps(-85.0, 85.0, 5.0);
    for (const double off : {0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0})
      for (const double side : {-1.0, 1.0})
        if (std::abs(theta_in_deg + side * off) < 89.0)
          in_plane.push_back(theta_in_deg + side * off);
    std::vector<double> out_of_plane = steps(0.0, 85.0, 5.0);
    for (const double off : {0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 7.0})
      out_of_plane.push_back(off);
    std::sort(in_plane.begin(), in_plane.end());
    in_plane.erase(std::unique(in_plane.begin(), in_plane.end()), in_plane.end());
    for (const double p : in_plane)
      for (const double o : out_of_plane) measure(points, theta_in_deg, p, o, f);
  }
  return points;
}

}  // namespace test_support
