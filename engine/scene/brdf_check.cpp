#include "engine/scene/brdf_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "engine/core/constants.h"
#include "engine/scene/hemisphere_integral.h"
#include "engine/scene/surface_frame.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kCone_rad = 15.0 * kDegree;
constexpr double kIncidence_rad = 45.0 * kDegree;
// Below this a lobe is lost in what a goniometer resolves of a diffuse surface.
constexpr double kNoLobe = 0.02;
// Notes are for what is worse than this.
constexpr double kOffMirror_deg = 35.0;
constexpr double kFewDirections = 0.7;
constexpr double kWideStep_deg = 20.5;
constexpr double kOneWay = 0.1;
constexpr double kLeftRight = 0.1;

double before_limit(const Brdf& brdf, double cos_in) {
  if (const TabulatedBrdf* table = brdf.table()) return table->albedo_as_measured(cos_in);
  return brdf.five_parameters()->albedo_before_limit(cos_in);
}

void check_energy(const Brdf& brdf, BrdfCheck& check) {
  constexpr double kStep_deg = 0.1;
  constexpr int kSteps = 895;
  for (int i = 0; i <= kSteps; ++i) {
    const double deg = kStep_deg * i;
    const double cos_in = std::cos(deg * kDegree);
    const double came = albedo_as_it_came(brdf, cos_in);
    check.largest_albedo = std::max(check.largest_albedo, came);
    if (came > 1.0) check.makes_light_from_deg = std::min(check.makes_light_from_deg, deg);
    const double before = before_limit(brdf, cos_in);
    if (!(before > 1.0)) continue;
    check.limited_from_deg = std::min(check.limited_from_deg, deg);
    check.most_taken = std::max(check.most_taken, 1.0 - brdf.albedo(cos_in) / before);
  }
}

void check_lobe(const Brdf& brdf, BrdfCheck& check) {
  const double cos_in = std::cos(kIncidence_rad);
  double even = std::numeric_limits<double>::infinity();
  static_cast<void>(hemisphere_integral<16, 16>(cos_in, [&](const auto& in, const auto& out) {
    if (out.z() > 0.1) even = std::min(even, brdf.eval(in, out));
    return 0.0;
  }));
  const Vector3d mirror = mirrored(incident_direction(kIncidence_rad));
  const double cone = 1.0 - std::cos(kCone_rad);
  // All of it, what is within the cone, and the middle's x and z.
  const auto excess = [&](const Vector3d& in, const Vector3d& out) -> Eigen::Vector4d {
    const double here = std::max(0.0, brdf.eval(in, out) - even);
    const double inside = one_minus_cos(mirror, out) <= cone ? here : 0.0;
    return {here, inside, here * out.x(), here * out.z()};
  };
  // Fine about the mirror direction, and about where a table has lobes besides.
  const TabulatedBrdf* table = brdf.table();
  const std::vector<Vector3d> aside =
      table != nullptr ? table->lobes_aside(cos_in) : std::vector<Vector3d>{};
  const Eigen::Vector4d lobe = aside.empty() ? hemisphere_integral<256, 96>(cos_in, excess)
                                             : hemisphere_integral<256, 96>(cos_in, aside, excess);
  const double all = lobe[0];
  if (!(all > kNoLobe * kPi * even)) {
    check.at_mirror = check.middle_off_mirror_deg = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  const Vector3d middle(lobe[2], 0.0, lobe[3]);
  check.at_mirror = lobe[1] / all;
  const double dot = std::clamp(mirror.dot(middle.normalized()), -1.0, 1.0);
  check.middle_off_mirror_deg = std::acos(dot) / kDegree;
}

/// Of a function of two directions: how far from the same both ways.
template <class F>
double one_way_rms(double furthest_rad, const F& f) {
  constexpr int kAngles = 8;
  constexpr int kTurns = 6;
  double sum2 = 0;
  int pairs = 0;
  for (int i = 1; i < kAngles; ++i) {
    for (int k = 0; k < i; ++k) {
      for (int turn = 0; turn < kTurns; ++turn) {
        const Vector3d a = incident_direction(furthest_rad * i / (kAngles - 1));
        const Vector3d b = scatter_direction(
            ScatterAngles::kPolar, furthest_rad * k / (kAngles - 1), kPi * turn / (kTurns - 1));
        const double forth = f(a, b);
        const double back = f(b, a);
        if (!(forth + back > 0.0)) continue;
        sum2 += std::pow((forth - back) / (forth + back), 2);
        ++pairs;
      }
    }
  }
  return pairs > 0 ? std::sqrt(sum2 / pairs) : 0.0;
}

void check_aside(const BrdfGrid& grid, BrdfCheck& check) {
  double brightest = 0;
  for (std::size_t i = 0; i < grid.incidences(); ++i) {
    const auto& aside = grid.lobe_aside(i);
    if (!aside) continue;
    const Vector3d in = incident_direction(grid.incidence_rad(i));
    const Vector3d mirror = mirrored(in);
    const double there = grid.at(in, *aside);
    if (there <= brightest || there < 2.0 * grid.at(in, mirror)) continue;
    brightest = there;
    check.aside_at_deg = grid.incidence_rad(i) / kDegree;
    check.aside_off_mirror_deg = std::acos(std::clamp(mirror.dot(*aside), -1.0, 1.0)) / kDegree;
  }
}

void check_table(const BrdfGrid& grid, BrdfCheck& check) {
  check_aside(grid, check);
  check.measured = true;
  check.left_right_rms = grid.left_right_rms();
  const std::size_t last = grid.incidences() - 1;
  check.first_in_deg = grid.incidence_rad(0) / kDegree;
  check.last_in_deg = grid.incidence_rad(last) / kDegree;
  for (std::size_t i = 0; i <= last; ++i) {
    check.least_coverage = std::min(check.least_coverage, grid.coverage(i));
    if (i > 0)
      check.widest_step_deg = std::max(
          check.widest_step_deg, (grid.incidence_rad(i) - grid.incidence_rad(i - 1)) / kDegree);
  }
}

template <class... Args>
std::string text(const char* format, Args... args) {
  char line[200];
  std::snprintf(line, sizeof line, format, args...);
  return line;
}

}  // namespace

namespace {

/// A Lambert surface is not one that eq 7 was printed for.
bool is_eq_7(const Brdf& brdf) noexcept {
  const FiveParameterBrdf* five = brdf.five_parameters();
  return five != nullptr &&
         (five->parameters().kb > 0.0 || five->variant() == Brdf::Variant::kPaper);
}

}  // namespace

double albedo_as_it_came(const Brdf& brdf, double cos_in) noexcept {
  return is_eq_7(brdf) ? brdf.five_parameters()->albedo_as_printed(cos_in)
                       : before_limit(brdf, cos_in);
}

BrdfCheck check_brdf(const Brdf& brdf) {
  BrdfCheck check;
  check_energy(brdf, check);
  check_lobe(brdf, check);
  double furthest_rad = 70.0 * kDegree;
  if (const TabulatedBrdf* table = brdf.table()) {
    check_table(table->grid(), check);
    furthest_rad = std::min(furthest_rad, check.last_in_deg * kDegree);
    check.one_way_before_rms = one_way_rms(
        furthest_rad, [&](const auto& a, const auto& b) { return table->grid().at(a, b); });
  } else {
    check.one_way_before_rms = one_way_rms(furthest_rad, [&](const auto& a, const auto& b) {
      return is_eq_7(brdf) ? brdf.five_parameters()->as_printed(a, b) : brdf.eval(a, b);
    });
  }
  check.one_way_rms =
      one_way_rms(furthest_rad, [&](const auto& a, const auto& b) { return brdf.eval(a, b); });
  return check;
}

std::string brdf_note(const std::string& name, const BrdfCheck& check) {
  std::string note;
  const auto add = [&](const std::string& part) { note += (note.empty() ? "" : "; ") + part; };
  const char* as = check.measured ? "measured" : "printed";
  if (check.makes_light_from_deg < BrdfCheck::kNever)
    add(text("as %s its albedo passes 1 from %.1f deg on", as, check.makes_light_from_deg));
  if (check.makes_light_from_deg < BrdfCheck::kNever && check.limited_from_deg == BrdfCheck::kNever)
    note += ", as in use never";
  if (check.limited_from_deg < BrdfCheck::kNever)
    add(text("limited from %.1f deg on, by %.0f %% of the light at most", check.limited_from_deg,
             100.0 * check.most_taken));
  if (check.middle_off_mirror_deg > kOffMirror_deg)
    add(text("its lobe is not at the mirror: %.0f deg off it, %.0f %% within 15 deg",
             check.middle_off_mirror_deg, 100.0 * check.at_mirror));
  else if (std::isfinite(check.aside_at_deg))
    add(text("its brightest reading at %g deg of incidence is %.0f deg off the mirror",
             check.aside_at_deg, check.aside_off_mirror_deg));
  if (check.one_way_rms > kOneWay)
    add(text("not reciprocal: %.0f %% rms", 100.0 * check.one_way_rms));
  if (check.measured) {
    if (check.one_way_rms <= kOneWay && check.one_way_before_rms > kOneWay)
      add(text("measured %.0f %% rms from reciprocal, and made so",
               100.0 * check.one_way_before_rms));
    if (check.least_coverage < kFewDirections)
      add(text("measured over %.0f %% of the hemisphere, the edge held beyond",
               100.0 * check.least_coverage));
    if (check.widest_step_deg > kWideStep_deg)
      add(text("%.0f deg between two incidences", check.widest_step_deg));
    if (check.left_right_rms > kLeftRight)
      add(text("left and right differ by %.0f %% rms: is it isotropic?",
               100.0 * check.left_right_rms));
  }
  return note.empty() ? note : "material " + name + ": " + note;
}

}  // namespace engine
