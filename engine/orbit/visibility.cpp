#include "engine/orbit/visibility.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr std::size_t kConditions = 4;
constexpr Duration kShortestStep{1'000'000};
// No two bodies in closed Earth orbits above the surface approach faster than 2 * 11.2 km/s.
constexpr double kFastestApproach_m_s = 22.4e3;
constexpr double kFastestBody_m_s = 11.2e3;

struct Margins {
  std::array<double, kConditions> seconds{};  ///< no sooner than this can the sign change
  [[nodiscard]] bool clear() const noexcept {
    return std::all_of(seconds.begin(), seconds.end(), [](double s) { return s > 0.0; });
  }
  [[nodiscard]] Condition worst() const noexcept {
    return static_cast<Condition>(std::min_element(seconds.begin(), seconds.end()) -
                                  seconds.begin());
  }
  /// How far one may step without losing a change of clear().
  [[nodiscard]] double safe_step_s() const noexcept {
    return std::abs(*std::min_element(seconds.begin(), seconds.end()));
  }
};

class Search {
 public:
  Search(const Propagator& camera, const Propagator& target, const VisibilitySpec& spec,
         Epoch epoch)
      : camera_(camera), target_(target), spec_(spec), epoch_(epoch) {}

  [[nodiscard]] Margins margins(SimTime t) const noexcept {
    const Epoch now = epoch_ + t.time_since_epoch();
    const Position<J2000> camera = camera_.at(now).position;
    const Position<J2000> target = target_.at(now).position;
    const Position<J2000> sun = sun_position(spec_.sun, now);
    const Eigen::Vector3d line = target.m - camera.m;
    const double range_m = line.norm();
    const double off_sun_rad = angle_between_rad(line, sun.m - camera.m);
    Margins m;
    m.seconds[0] = (spec_.max_range_m - range_m) / kFastestApproach_m_s;
    m.seconds[1] =
        line_of_sight_margin_m(camera, target, spec_.line_of_sight_height_m) / kFastestBody_m_s;
    m.seconds[2] = shadow_margin_m(target, sun) / kFastestBody_m_s;
    // Times the range it is a length, whose change the approach bounds: |d(r a)| <= v (1 + pi).
    m.seconds[3] =
        range_m * (off_sun_rad - spec_.sun_exclusion_rad) / (kFastestApproach_m_s * (1.0 + kPi));
    return m;
  }

  /// The first nanosecond in (before, after] that is on the other side. Pre: the sides differ.
  [[nodiscard]] SimTime edge(SimTime before, SimTime after) const noexcept {
    const bool was_clear = margins(before).clear();
    while (after - before > Duration(1)) {
      const SimTime middle = before + (after - before) / 2;
      (margins(middle).clear() == was_clear ? before : after) = middle;
    }
    return after;
  }

  [[nodiscard]] double range_m(SimTime t) const noexcept {
    const Epoch now = epoch_ + t.time_since_epoch();
    return (target_.at(now).position.m - camera_.at(now).position.m).norm();
  }

  void find_closest(Pass& pass) const noexcept {
    const auto closing = [this](SimTime t) {
      const Epoch now = epoch_ + t.time_since_epoch();
      const OrbitState c = camera_.at(now);
      const OrbitState o = target_.at(now);
      return (o.position.m - c.position.m).dot(o.velocity.m_s - c.velocity.m_s) < 0.0;
    };
    SimTime low = pass.start;
    SimTime high = pass.end;
    if (!closing(low)) {
      high = low;
    } else if (closing(high)) {
      low = high;
    }
    while (high - low > Duration(1)) {
      const SimTime middle = low + (high - low) / 2;
      (closing(middle) ? low : high) = middle;
    }
    pass.closest = high;
    pass.min_range_m = range_m(high);
  }

 private:
  const Propagator& camera_;
  const Propagator& target_;
  const VisibilitySpec& spec_;
  Epoch epoch_;
};

}  // namespace

std::string_view name_of(Condition condition) noexcept {
  constexpr std::array<std::string_view, 5> kNames{"range", "line-of-sight", "eclipse",
                                                   "sun-exclusion", "span"};
  return kNames[static_cast<std::size_t>(condition)];
}

VisibilitySpec read_visibility(const ConfigTable& table, SunModel sun,
                               double half_diagonal_field_rad) {
  VisibilitySpec spec;
  spec.max_range_m = table.number_or("max_range_km", 300.0, positive()) * 1e3;
  spec.line_of_sight_height_m =
      table.number_or("line_of_sight_height_km", 0.0, between(0.0, 1000.0)) * 1e3;
  const double margin_rad = table.number_or("sun_margin_deg", 0.0, from_below(0.0, 90.0)) * kDegree;
  spec.sun_exclusion_rad = kSunAngularRadius_rad + half_diagonal_field_rad + margin_rad;
  spec.sun = sun;
  return spec;
}

double line_of_sight_margin_m(const Position<J2000>& camera, const Position<J2000>& target,
                              double height_m) noexcept {
  const Eigen::Vector3d line = target.m - camera.m;
  const double length2 = line.squaredNorm();
  // The place on the segment closest to the Earth's centre; its ends where the foot lies outside.
  const double along = length2 > 0.0 ? std::clamp(-camera.m.dot(line) / length2, 0.0, 1.0) : 0.0;
  return (camera.m + along * line).norm() - (kEarthRadius_m + height_m);
}

double shadow_margin_m(const Position<J2000>& body, const Position<J2000>& sun) noexcept {
  const Eigen::Vector3d to_sun = sun.m.normalized();
  const double along = body.m.dot(to_sun);
  if (along >= 0.0) return body.m.norm() - kEarthRadius_m;
  return (body.m - along * to_sun).norm() - kEarthRadius_m;
}

bool earth_is_behind(const Position<J2000>& camera, const Position<J2000>& target) noexcept {
  const Eigen::Vector3d line = (target.m - camera.m).normalized();
  const double along = -camera.m.dot(line);
  return along > 0.0 && (camera.m + along * line).norm() < kEarthRadius_m;
}

std::vector<Pass> find_passes(const Propagator& camera, const Propagator& target,
                              const VisibilitySpec& spec, Epoch epoch, SimTime begin, SimTime end) {
  const Search search(camera, target, spec, epoch);
  std::vector<Pass> passes;
  Pass open;
  Margins now = search.margins(begin);
  bool inside = now.clear();
  if (inside) open.start = begin;
  for (SimTime t = begin; t < end;) {
    const Duration step = std::max(kShortestStep, from_seconds(now.safe_step_s()));
    const SimTime next = std::min(end, t + step);
    const Margins then = search.margins(next);
    if (then.clear() && !inside) {
      open.start = search.edge(t, next);
      open.start_limited_by = search.margins(open.start - Duration(1)).worst();
    } else if (!then.clear() && inside) {
      open.end = search.edge(t, next);
      open.end_limited_by = search.margins(open.end).worst();
      search.find_closest(open);
      passes.push_back(open);
      open = {};
    }
    inside = then.clear();
    now = then;
    t = next;
  }
  if (inside) {
    open.end = end;
    search.find_closest(open);
    passes.push_back(open);
  }
  return passes;
}

}  // namespace engine
