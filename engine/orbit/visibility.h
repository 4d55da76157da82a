#pragma once

#include <string_view>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/orbit/propagator.h"
#include "engine/orbit/sun.h"

namespace engine {

/// The conditions of table 2 of Li et al. 2023, and the ends of the search.
enum class Condition : std::uint8_t { kRange, kLineOfSight, kEclipse, kSunExclusion, kSpan };
[[nodiscard]] std::string_view name_of(Condition condition) noexcept;

struct VisibilitySpec {
  double max_range_m = 300e3;
  double line_of_sight_height_m = 0;  ///< the line must clear the Earth by this
  double sun_exclusion_rad = 0;       ///< between the line of sight and the Sun's centre
  SunModel sun = SunModel::kErfa;
};
[[nodiscard]] VisibilitySpec read_visibility(const ConfigTable& table, SunModel sun,
                                             double half_diagonal_field_rad);

/// The Earth is in the way when this is negative: the height of the line from camera to target
/// above a sphere of radius kEarthRadius_m + height_m, in metres. The same as beta and alpha of
/// table 2 as corrected, without its angles.
[[nodiscard]] double line_of_sight_margin_m(const Position<J2000>& camera,
                                            const Position<J2000>& target,
                                            double height_m) noexcept;

/// Negative in the Earth's shadow, taken as a cylinder: the distance to it in metres.
[[nodiscard]] double shadow_margin_m(const Position<J2000>& body,
                                     const Position<J2000>& sun) noexcept;

/// Whether the line of sight, prolonged beyond the target, meets the Earth.
[[nodiscard]] bool earth_is_behind(const Position<J2000>& camera,
                                   const Position<J2000>& target) noexcept;

/// A time in which the camera can see the target. All positions geometric, no light time.
struct Pass {
  SimTime start;
  SimTime end;
  SimTime closest;
  double min_range_m = 0;
  Condition start_limited_by = Condition::kSpan;
  Condition end_limited_by = Condition::kSpan;
};

/// All passes in [begin, end], edges to 1 ns of the model's own.
///
/// Lipschitz stepping: no margin can fall to zero sooner than it divided by its fastest change, so
/// the step is as long as that allows and no pass longer than 1 ms is missed. Where the margins are
/// all but zero the step is 1 ms.
[[nodiscard]] std::vector<Pass> find_passes(const Propagator& camera, const Propagator& target,
                                            const VisibilitySpec& spec, Epoch epoch, SimTime begin,
                                            SimTime end);

}  // namespace engine
