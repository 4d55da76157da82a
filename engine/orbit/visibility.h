#pragma once

#include <optional>
#include <string_view>

#include "engine/core/config_reader.h"
#include "engine/orbit/propagator.h"
#include "engine/orbit/shadow.h"
#include "engine/orbit/signal_limit.h"
#include "engine/orbit/sun.h"

namespace engine {

/// What lets a camera see a target, or not: the conditions of table 2 of Li et al. 2023.
enum class Condition : std::uint8_t {
  kRange,
  kLineOfSight,
  kEclipse,
  kSunExclusion,
  kField,        ///< of a camera that looks at one place in the sky
  kSignal,       ///< to noise
  kEarthBehind,  ///< not needed to see it; where it holds the frame's background is the Earth
  kSpan,         ///< the ends of the search
};
inline constexpr std::size_t kConditions = 7;  ///< without kSpan
[[nodiscard]] std::string_view name_of(Condition condition) noexcept;

/// What a camera at rest among the stars sees: directions by x/z and y/z. Without distortion.
struct FieldOfView {
  Rotation<CameraFrame, J2000> axes;
  double left_tan = 0, right_tan = 0;
  double top_tan = 0, bottom_tan = 0;
};

struct VisibilitySpec {
  double max_range_m = 300e3;
  double line_of_sight_height_m = 0;  ///< the line must clear the Earth by this
  double sun_exclusion_rad = 0;       ///< between the line of sight and the Sun's centre
  SunModel sun = SunModel::kErfa;
  ShadowModel shadow = ShadowModel::kOblateCone;  ///< lit: any of the Sun is seen
  std::optional<FieldOfView> field;               ///< nothing: the camera follows the target
  std::optional<SignalLimit> signal;              ///< nothing: as faint as may be
};
/// Of the signal's limit only what stands in the table; the camera's part is left at 0.
[[nodiscard]] VisibilitySpec read_visibility(const ConfigTable& table, SunModel sun,
                                             double half_diagonal_field_rad);

/// The Earth is in the way when this is negative: the height of the line from camera to target
/// above a sphere of radius kEarthRadius_m + height_m, in metres. The same as beta and alpha of
/// table 2 as corrected, without its angles.
[[nodiscard]] double line_of_sight_margin_m(const Position<J2000>& camera,
                                            const Position<J2000>& target,
                                            double height_m) noexcept;

/// Whether the line of sight, prolonged beyond the target, meets the Earth.
[[nodiscard]] bool earth_is_behind(const Position<J2000>& camera,
                                   const Position<J2000>& target) noexcept;

}  // namespace engine
