#pragma once

#include <vector>

#include "engine/orbit/visibility.h"
#include "engine/orbit/visibility_margins.h"

namespace engine {

/// A time in which some conditions are met, and which of them begin and end it.
struct Window {
  SimTime start;
  SimTime end;
  Condition start_limited_by = Condition::kSpan;
  Condition end_limited_by = Condition::kSpan;

  /// It goes on beyond an end of the search.
  [[nodiscard]] bool truncated() const noexcept {
    return start_limited_by == Condition::kSpan || end_limited_by == Condition::kSpan;
  }
};

/// A time in which the camera can see the target.
struct Pass : Window {
  SimTime closest;
  double min_range_m = 0;
};

/// All windows of some conditions in [begin, end], edges to 1 ns of the model's own. Where an orbit
/// has no answer the search ends.
///
/// No margin can be used up sooner than the margin's own bound (visibility_margins.h), so that
/// steps as long as that allows miss no window longer than 1 ms. A window opens where every margin
/// is over 0.1 mm and closes where one is below -0.1 mm, the orbits' own error after 15 days: a
/// touch is one window or none. Where margins hover in between, steps grow to 1 s.
[[nodiscard]] std::vector<Window> find_windows(const Propagator& camera, const Propagator& target,
                                               const VisibilitySpec& spec, Conditions conditions,
                                               Epoch epoch, SimTime begin, SimTime end);

/// All passes, in the same way.
[[nodiscard]] std::vector<Pass> find_passes(const Propagator& camera, const Propagator& target,
                                            const VisibilitySpec& spec, Epoch epoch, SimTime begin,
                                            SimTime end);

}  // namespace engine
