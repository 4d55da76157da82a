#include "engine/orbit/passes.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

constexpr Duration kShortestStep{1'000'000};
constexpr Duration kLongestOnTheEdge = std::chrono::seconds(1);
constexpr double kLongestStep_s = 86400.0;
constexpr double kOnTheEdge_m = 1e-4;

class Search {
 public:
  Search(VisibilityMargins& margins, Epoch epoch) noexcept : margins_(margins), epoch_(epoch) {}

  std::vector<Window> windows(SimTime begin, SimTime end) {
    std::vector<Window> found;
    Window open;
    Margins now = at(begin);
    bool inside = now.all.m > 0.0;
    if (inside) open.start = begin;
    SimTime last_on_this_side = begin;
    SimTime off_the_edge = begin;
    for (SimTime t = begin; t < end;) {
      const bool hovers = std::abs(now.all.m) < kOnTheEdge_m;
      if (!hovers) off_the_edge = t;
      const Duration least = std::clamp(t - off_the_edge, kShortestStep, kLongestOnTheEdge);
      const double safe_s = std::min(now.all.s, kLongestStep_s);
      const SimTime next = end - t > std::max(least, from_seconds(safe_s))
                               ? t + std::max(least, from_seconds(safe_s))
                               : end;
      if ((now.all.m > 0.0) == inside) last_on_this_side = t;
      now = at(next);
      if (!inside && now.all.m > kOnTheEdge_m) {
        open.start = edge(last_on_this_side, next, false);
        open.start_limited_by = at(open.start - Duration(1)).worst;
        inside = true;
      } else if (inside && now.all.m < -kOnTheEdge_m) {
        open.end = edge(last_on_this_side, next, true);
        open.end_limited_by = at(open.end).worst;
        found.push_back(open);
        open = {};
        inside = false;
      }
      t = next;
    }
    if (inside) {
      open.end = end;
      found.push_back(open);
    }
    return found;
  }

 private:
  [[nodiscard]] Margins at(SimTime t) noexcept {
    return margins_.at(epoch_ + t.time_since_epoch());
  }

  /// The first nanosecond in (before, after] that is on the other side. Pre: the sides differ.
  [[nodiscard]] SimTime edge(SimTime before, SimTime after, bool was_met) noexcept {
    while (after - before > Duration(1)) {
      const SimTime middle = before + (after - before) / 2;
      ((at(middle).all.m > 0.0) == was_met ? before : after) = middle;
    }
    return after;
  }

  VisibilityMargins& margins_;
  Epoch epoch_;
};

/// Where both orbits have an answer.
struct Reach {
  Reach(const Propagator& camera, const Propagator& target, Epoch epoch, SimTime from, SimTime to)
      : begin(from), end(to) {
    for (const EpochSpan& span : {camera.span(), target.span()}) {
      if (span.begin > epoch + begin.time_since_epoch()) begin = SimTime(span.begin - epoch);
      if (span.end < epoch + end.time_since_epoch()) end = SimTime(span.end - epoch);
    }
  }
  SimTime begin;
  SimTime end;
};

void find_closest(const Propagator& camera, const Propagator& target, Epoch epoch, Pass& pass) {
  const auto closing = [&](SimTime t) {
    const Epoch now = epoch + t.time_since_epoch();
    const OrbitState c = camera.at(now);
    const OrbitState o = target.at(now);
    return (o.position.m - c.position.m).dot(o.velocity.m_s - c.velocity.m_s) < 0.0;
  };
  // Each orbit of a formation may have its own closest approach, and none is shorter than this.
  constexpr Duration kApproach = std::chrono::minutes(1);
  const auto range_m = [&](SimTime t) {
    const Epoch now = epoch + t.time_since_epoch();
    return (target.at(now).position.m - camera.at(now).position.m).norm();
  };
  SimTime nearest = pass.start;
  double nearest_m = range_m(nearest);
  const bool one_approach = pass.end - pass.start <= kApproach;
  for (SimTime t = pass.start; !one_approach && t < pass.end;) {
    t = std::min(pass.end, t + kApproach);
    const double here_m = range_m(t);
    if (here_m < nearest_m) {
      nearest = t;
      nearest_m = here_m;
    }
  }
  SimTime low = one_approach ? pass.start : std::max(pass.start, nearest - kApproach);
  SimTime high = one_approach ? pass.end : std::min(pass.end, nearest + kApproach);
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

}  // namespace

std::vector<Window> find_windows(const Propagator& camera, const Propagator& target,
                                 const VisibilitySpec& spec, Conditions conditions, Epoch epoch,
                                 SimTime begin, SimTime end) {
  const Reach reach(camera, target, epoch, begin, end);
  if (!(reach.begin < reach.end)) return {};
  VisibilityMargins margins(camera, target, spec, conditions);
  return Search(margins, epoch).windows(reach.begin, reach.end);
}

std::vector<Pass> find_passes(const Propagator& camera, const Propagator& target,
                              const VisibilitySpec& spec, Epoch epoch, SimTime begin, SimTime end) {
  std::vector<Pass> passes;
  for (const Window& window :
       find_windows(camera, target, spec, Conditions::needed(spec), epoch, begin, end)) {
    passes.push_back({window, {}, 0.0});
    find_closest(camera, target, epoch, passes.back());
  }
  return passes;
}

}  // namespace engine
