// When a camera sees a target, and the edges of shadow.

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/orbit/passes.h"
#include "engine/orbit/shadow.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/paper_orbits.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using Eigen::Vector3d;
using engine::Position;

constexpr double kFifteenDays_s = 15.0 * 86400.0;

double range_m(const PaperOrbits& orbits, double t_s) {
  const engine::Epoch t = orbits.at(t_s);
  return (orbits.target.at(t).position.m - orbits.camera.at(t).position.m).norm();
}

/// How often samples find the range under a limit after it was over it.
int windows_by_steps(const PaperOrbits& orbits, double limit_m, double from_s, double to_s,
                     double step_s) {
  int found = 0;
  bool inside = false;
  for (double t_s = from_s; t_s <= to_s; t_s += step_s) {
    const bool now = range_m(orbits, t_s) < limit_m;
    found += now && !inside ? 1 : 0;
    inside = now;
  }
  return found;
}

std::vector<engine::Window> our_windows(const PaperOrbits& orbits, double limit_m, double from_s,
                                        double to_s) {
  engine::VisibilitySpec spec;
  spec.max_range_m = limit_m;
  return engine::find_windows(orbits.camera, orbits.target, spec, {engine::Condition::kRange},
                              orbits.epoch, engine::sim_time(from_s), engine::sim_time(to_s));
}

Corner short_windows() {
  const PaperOrbits orbits;
  constexpr double kLimit_m = 300e3;
  const int want = windows_by_steps(orbits, kLimit_m, 0.0, kFifteenDays_s, 5.0);
  const int plain = windows_by_steps(orbits, kLimit_m, 0.0, kFifteenDays_s, 60.0);
  const auto ours = static_cast<int>(our_windows(orbits, kLimit_m, 0.0, kFifteenDays_s).size());
  return {
      "windows of 15 to 40 s",
      "steps of 60 s",
      static_cast<double>(std::abs(plain - want)),
      static_cast<double>(std::abs(ours - want)),
      0,
      "missed",
      "Of the 16 windows under 300 km in 15 days, which steps of 5 s find: no window is shorter "
      "than three of these. Ours steps as far as the speeds allow (Lipschitz)."};
}

/// Where the range has its minimum, by the golden section.
double closest_s(const PaperOrbits& orbits, double low_s, double high_s) {
  const double part = 0.5 * (std::sqrt(5.0) - 1.0);
  for (int i = 0; i < 60; ++i) {
    const double a_s = high_s - part * (high_s - low_s);
    const double b_s = low_s + part * (high_s - low_s);
    (range_m(orbits, a_s) < range_m(orbits, b_s) ? high_s : low_s) =
        range_m(orbits, a_s) < range_m(orbits, b_s) ? b_s : a_s;
  }
  return 0.5 * (low_s + high_s);
}

Corner tangency() {
  const PaperOrbits orbits;
  const double least_m =
      range_m(orbits, closest_s(orbits, kClosestOfPass3_s - 60.0, kClosestOfPass3_s + 60.0));
  const double from_s = std::floor(kClosestOfPass3_s) - 300.5;
  const double to_s = from_s + 600.0;
  Worst plain;
  Worst ours;
  for (const double beyond_m : {-1.0, -0.01, 0.01, 1.0}) {
    const double limit_m = least_m + beyond_m;
    const int want = beyond_m > 0.0 ? 1 : 0;
    plain.add(std::abs(windows_by_steps(orbits, limit_m, from_s, to_s, 1.0) - want));
    const auto found = static_cast<int>(our_windows(orbits, limit_m, from_s, to_s).size());
    ours.add(std::abs(found - want));
  }
  return {"a range that is just touched",
          "steps of 1 s",
          plain.value(),
          ours.value(),
          0,
          "wrong",
          "Windows too many or too few where the limit is 1 m or 1 cm from the closest approach: "
          "one if beyond it, none if short of it."};
}

Corner window_edge() {
  const PaperOrbits orbits;
  constexpr double kLimit_m = 300e3;
  const double from_s = kClosestOfPass3_s - 200.0;
  double low_s = from_s;
  double high_s = kClosestOfPass3_s;
  for (int i = 0; i < 60; ++i) {
    const double middle_s = 0.5 * (low_s + high_s);
    (range_m(orbits, middle_s) > kLimit_m ? low_s : high_s) = middle_s;
  }
  Worst plain;
  for (int phase = 0; phase < 10; ++phase) {
    double sampled_s = from_s + 0.1 * phase;
    while (range_m(orbits, sampled_s) > kLimit_m) sampled_s += 1.0;
    plain.add(sampled_s - low_s);
  }
  const auto found = our_windows(orbits, kLimit_m, from_s, kClosestOfPass3_s);
  const double ours_s = found.empty() ? HUGE_VAL : engine::seconds(found.front().start);
  return {"the edge of a window",
          "first sample inside, 1 s",
          plain.value(),
          std::abs(ours_s - low_s),
          1e-6,
          "s",
          "Time of entry against bisection to the clock's nanosecond. The bound: .1 mm of the "
          "orbits' own rounding after 15 days, at 10 km/s 1e-8 s, a hundred times."};
}

/// By places on the Sun's disc whose rays meet the Earth or not.
double counted_lit(const Vector3d& body, const Vector3d& sun) {
  constexpr int kPlaces = 20000;
  constexpr double kSunRadius_m = 6.957e8;
  const Vector3d z = (sun - body).normalized();
  const Vector3d x = z.unitOrthogonal();
  const Vector3d y = z.cross(x);
  const double tan = std::tan(std::asin(kSunRadius_m / (sun - body).norm()));
  const double clear_m2 = body.squaredNorm() - engine::kEarthRadius_m * engine::kEarthRadius_m;
  int seen = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double r = tan * std::sqrt((i + 0.5) / kPlaces);
    const double turn = i * 2.399963229728653;  // the golden angle
    const Vector3d ray = z + r * (std::cos(turn) * x + std::sin(turn) * y);
    const double along = body.dot(ray);
    seen += along < 0.0 && along * along > ray.squaredNorm() * clear_m2 ? 0 : 1;
  }
  return static_cast<double>(seen) / kPlaces;
}

Corner penumbra() {
  const Position<engine::J2000> sun{{engine::kAstronomicalUnit_m, 0, 0}};
  Worst plain;
  Worst ours;
  for (int i = -40; i <= 40; ++i) {
    const double behind_m = 2.2e6;
    const Position<engine::J2000> body{{-behind_m, engine::kEarthRadius_m + 600.0 * i, 0}};
    const double want = counted_lit(body.m, sun.m);
    plain.add(std::abs(lit_fraction(engine::ShadowModel::kCylinder, body, sun) - want));
    ours.add(std::abs(lit_fraction(engine::ShadowModel::kCone, body, sun) - want));
  }
  return {"the edge of the Earth's shadow",
          "cylinder, at once",
          plain.value(),
          ours.value(),
          2e-3,
          "of E",
          "Share of the Sun's disc that is seen, against 20000 of its places. The bound: such a "
          "count is good to 1e-3, and the limb is taken for a circle. Montenbruck and Gill 2000, "
          "section 3.4.2."};
}

}  // namespace

Room visibility_corners() {
  return {"Visibility and shadow", {short_windows(), tangency(), window_edge(), penumbra()}};
}

}  // namespace corners
