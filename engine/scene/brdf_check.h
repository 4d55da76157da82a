#pragma once

#include <limits>
#include <string>

#include "engine/scene/brdf.h"

namespace engine {

/// What is to be known of a surface before its pictures are believed.
struct BrdfCheck {
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// The incidence from which on eq 7 as printed, or the table as measured, sends back more than
  /// comes in; and how much at most, up to 89.5 deg.
  double makes_light_from_deg = kNever;
  double largest_albedo = 0;
  /// The incidence from which on the variant in use is limited, and the largest share of the
  /// light that this takes, up to 89.5 deg.
  double limited_from_deg = kNever;
  double most_taken = 0;
  /// Of what stands out of the surface's even part at 45 deg of incidence, the share within 15 deg
  /// of the mirror direction; not a number for a surface without a lobe.
  double at_mirror = 0;
  /// Of the same, how far its middle is from the mirror direction: tens of degrees for a wide lobe
  /// that the horizon cuts, 90 for one that looks back at its source.
  double middle_off_mirror_deg = 0;
  /// Of a table, the incidence of the brightest reading that is over 10 deg off the mirror
  /// direction and twice what goes there, and how far off; not a number without one.
  double aside_at_deg = std::numeric_limits<double>::quiet_NaN();
  double aside_off_mirror_deg = std::numeric_limits<double>::quiet_NaN();
  /// As in use, and as printed or measured: rms of (a - b) / (a + b) of a pair of directions
  /// both ways, over pairs within 70 deg of the normal, or within the table's incidences.
  double one_way_rms = 0;
  double one_way_before_rms = 0;

  // Of a table.
  bool measured = false;
  double first_in_deg = 0;
  double last_in_deg = 0;
  double widest_step_deg = 0;
  double least_coverage = 1;  ///< BrdfGrid::coverage
  double left_right_rms = 0;  ///< BrdfGrid::left_right_rms
};
/// Takes some milliseconds; some tens of them for a table.
[[nodiscard]] BrdfCheck check_brdf(const Brdf& brdf);

/// The share of light from `cos_in` that eq 7 as printed, or the table as measured, sends anywhere.
[[nodiscard]] double albedo_as_it_came(const Brdf& brdf, double cos_in) noexcept;

/// One line on what a user should know of it; empty when there is nothing.
[[nodiscard]] std::string brdf_note(const std::string& name, const BrdfCheck& check);

}  // namespace engine
