#include "engine/orbit/visibility_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"

namespace engine {
namespace {

// Gravity at the ground: 9.81 m/s^2 at the poles, and thrust.
constexpr double kFall_m_s2 = 9.95;
// How it differs between two places, for each metre: 2 mu / R^3, half as much again for places
// with the Earth between them; and thrust.
constexpr double kTide_1_s2 = 5e-6;
constexpr double kThrust_m_s2 = 0.1;
// The Sun's direction: of the year, and of a body's own motion (11.2 km/s over 1 au).
constexpr double kSunTurns_rad_s = 2.1e-7 + 0.8e-7;
// Shut for as long by the range alone, the others need not be known.
constexpr double kLong_s = 60.0;
// Where the bound of a rate is only good for a while.
constexpr double kWhile_s = 10.0;
// Closer than this, directions mean nothing.
constexpr double kTouching_m = 1.0;

/// When a way is used up at `rate` to begin with, growing by `bend` a second. Pre: way_m >= 0,
/// bend > 0.
double time_of(double way_m, double rate_m_s, double bend_m_s2) noexcept {
  const double root = std::sqrt(rate_m_s * rate_m_s + 2.0 * bend_m_s2 * way_m);
  return rate_m_s > 0.0 ? 2.0 * way_m / (rate_m_s + root) : (root - rate_m_s) / bend_m_s2;
}

double relative_acceleration_m_s2(double largest_range_m) noexcept {
  return std::min(2.0 * kFall_m_s2, kTide_1_s2 * largest_range_m) + kThrust_m_s2;
}

/// Of a place at a distance from the tip of a cone, `off_rad` from its edge: how far to that edge.
double way_to_cone_m(double distance_m, double off_rad) noexcept {
  return distance_m * std::sin(std::clamp(off_rad, -0.5 * kPi, 0.5 * kPi));
}

}  // namespace

struct VisibilityMargins::Moment {
  OrbitState camera;
  OrbitState target;
  Eigen::Vector3d line_m;     ///< from camera to target
  Eigen::Vector3d speed_m_s;  ///< of its end
  double range_m = 0;
};

Conditions Conditions::needed(const VisibilitySpec& spec) noexcept {
  Conditions needed{Condition::kRange, Condition::kLineOfSight, Condition::kEclipse,
                    Condition::kSunExclusion};
  const auto add = [&needed](Condition c) { needed.bits_ |= 1U << static_cast<unsigned>(c); };
  if (spec.field) add(Condition::kField);
  if (spec.signal) add(Condition::kSignal);
  return needed;
}

VisibilityMargins::VisibilityMargins(const Propagator& camera, const Propagator& target,
                                     const VisibilitySpec& spec, Conditions conditions) noexcept
    : camera_(camera),
      target_(target),
      spec_(spec),
      conditions_(conditions),
      fastest_body_m_s_(std::max(camera.speed_bound_m_s(), target.speed_bound_m_s())),
      fastest_approach_m_s_(camera.speed_bound_m_s() + target.speed_bound_m_s()),
      sun_(spec.sun) {}

Margin VisibilityMargins::range(const Moment& now) const noexcept {
  const double m = spec_.max_range_m - now.range_m;
  const double from_m = std::max(now.range_m, kTouching_m);
  const double range_rate_m_s = now.speed_m_s.dot(now.line_m) / from_m;
  // Seen from a straight line the range bends up by v^2 / r, and never down.
  const double bend_m_s2 =
      m > 0.0 ? relative_acceleration_m_s2(spec_.max_range_m) + now.speed_m_s.squaredNorm() / from_m
              : relative_acceleration_m_s2(std::numeric_limits<double>::infinity());
  const double s = time_of(std::abs(m), m > 0.0 ? range_rate_m_s : -range_rate_m_s, bend_m_s2);
  return {m, std::max(s, std::abs(m) / fastest_approach_m_s_)};
}

Margin VisibilityMargins::by_relative_motion(double m, const Moment& now,
                                             double more_m_s) const noexcept {
  const double way_m = std::abs(m);
  const double bend_m_s2 = relative_acceleration_m_s2(now.range_m + way_m);
  const double s = time_of(way_m, now.speed_m_s.norm() + more_m_s, bend_m_s2);
  return {m, std::max(s, way_m / (fastest_approach_m_s_ + more_m_s))};
}

Margin VisibilityMargins::line_of_sight(const Moment& now) const noexcept {
  const double m = line_of_sight_margin_m(now.camera.position, now.target.position,
                                          spec_.line_of_sight_height_m);
  const double v_m_s = std::max(now.camera.velocity.m_s.norm(), now.target.velocity.m_s.norm());
  return {m, std::max(time_of(std::abs(m), v_m_s, kFall_m_s2), std::abs(m) / fastest_body_m_s_)};
}

Margin VisibilityMargins::sunlight(const Moment& now, const Position<J2000>& sun) const noexcept {
  const double m = shadow_margin_m(spec_.shadow, now.target.position, sun);
  const double turns_m_s = kSunTurns_rad_s * now.target.position.m.norm();
  const double v_m_s = now.target.velocity.m_s.norm() + turns_m_s;
  return {m, std::max(time_of(std::abs(m), v_m_s, kFall_m_s2),
                      std::abs(m) / (target_.speed_bound_m_s() + turns_m_s))};
}

Margin VisibilityMargins::sun_exclusion(const Moment& now,
                                        const Position<J2000>& sun) const noexcept {
  const double off_sun_rad = angle_between_rad(now.line_m, sun.m - now.camera.position.m);
  const double from_m = std::max(now.range_m, kTouching_m);
  return by_relative_motion(way_to_cone_m(from_m, off_sun_rad - spec_.sun_exclusion_rad), now,
                            kSunTurns_rad_s * from_m);
}

Margin VisibilityMargins::field(const Moment& now) const noexcept {
  const Eigen::Vector3d seen = spec_.field->axes.matrix * now.line_m;
  // The least height over the four planes through the pupil and the field's sides.
  const auto over = [z = seen.z()](double across, double tan) {
    return (across - tan * z) / std::sqrt(1.0 + tan * tan);
  };
  const double m =
      std::min({over(seen.x(), spec_.field->left_tan), -over(seen.x(), spec_.field->right_tan),
                over(seen.y(), spec_.field->top_tan), -over(seen.y(), spec_.field->bottom_tan)});
  return by_relative_motion(m, now, 0.0);
}

Margin VisibilityMargins::signal(const Moment& now, const Position<J2000>& sun) const noexcept {
  const double phase_rad = angle_between_rad(sun.m - now.target.position.m, -now.line_m);
  const double from_m = std::max(now.range_m, kTouching_m);
  return by_relative_motion(spec_.signal->margin_m(from_m, phase_rad), now,
                            kSunTurns_rad_s * from_m);
}

Margin VisibilityMargins::earth_behind(const Moment& now) const noexcept {
  const Eigen::Vector3d& camera_m = now.camera.position.m;
  const double r = camera_m.norm();
  const double horizon_m = std::sqrt(std::max(1.0, r * r - kEarthRadius_m * kEarthRadius_m));
  const double earth_rad = std::atan2(kEarthRadius_m, horizon_m);
  const double from_m = std::max(now.range_m, kTouching_m);
  // The Earth's own disc moves and grows as the camera does.
  const double turns_rad_s = now.camera.velocity.m_s.norm() * (1.0 / r + 1.0 / horizon_m);
  Margin margin = by_relative_motion(
      way_to_cone_m(from_m, earth_rad - angle_between_rad(now.line_m, -camera_m)), now,
      1.1 * turns_rad_s * from_m);
  margin.s = std::min(margin.s, kWhile_s);
  return margin;
}

Margins VisibilityMargins::at(Epoch t) noexcept {
  Moment now{camera_.at(t), target_.at(t), {}, {}, 0.0};
  now.line_m = now.target.position.m - now.camera.position.m;
  now.speed_m_s = now.target.velocity.m_s - now.camera.velocity.m_s;
  now.range_m = now.line_m.norm();

  Margins margins{
      {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()},
      Condition::kSpan};
  double shut_s = 0;
  const auto add = [&](Condition condition, const auto& margin_of) {
    if (!conditions_.has(condition)) return;
    const Margin margin = margin_of();
    if (margin.m < margins.all.m) {
      margins.all.m = margin.m;
      margins.worst = condition;
    }
    margins.all.s = std::min(margins.all.s, margin.s);
    // Any of those that shut it does so alone.
    if (!(margin.m > 0.0)) shut_s = std::max(shut_s, margin.s);
  };
  add(Condition::kRange, [&] { return range(now); });
  if (shut_s < kLong_s) {
    const Position<J2000> sun = sun_.at(t);
    add(Condition::kLineOfSight, [&] { return line_of_sight(now); });
    add(Condition::kEclipse, [&] { return sunlight(now, sun); });
    add(Condition::kSunExclusion, [&] { return sun_exclusion(now, sun); });
    add(Condition::kField, [&] { return field(now); });
    add(Condition::kSignal, [&] { return signal(now, sun); });
    add(Condition::kEarthBehind, [&] { return earth_behind(now); });
  }
  if (!(margins.all.m > 0.0)) margins.all.s = shut_s;
  return margins;
}

}  // namespace engine
