#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/constants.h"

namespace engine {

inline constexpr double kMilliarcsecond_rad = kDegree / 3.6e6;
/// Barnard's star, the fastest, has 10 400.
inline constexpr double kFastestStar_mas_yr = 20000.0;

/// A row of a user's catalogue.
struct TableStar {
  double ra_rad = 0;
  double dec_rad = 0;
  double v_magnitude = 0;
  std::optional<double> colour_b_v;
  bool has_motion = false;
  double motion_ra_rad_yr = 0;  ///< times cos dec
  double motion_dec_rad_yr = 0;
  double years = 0;  ///< the place's epoch, Julian years after J2000
};

struct StarTable {
  std::vector<TableStar> stars;
};

/// The form is described at read_star_catalogue. At most 5 million stars. With bp_rp, mag is G and
/// V follows by G - V = -.02704 + .01424 c - .2156 c^2 + .01426 c^3 (Riello et al. 2021, A&A 649,
/// A3), good to .03 for -.5 < c < 5; B-V is that of the main sequence (Pecaut & Mamajek 2013, ApJS
/// 208, 9). Throws ConfigError: "name:line: complaint".
[[nodiscard]] StarTable read_star_table(std::string_view text, const std::string& name);

/// B-V of a main sequence star with this BP-RP.
[[nodiscard]] double b_v_of_gaia_colour(double bp_rp) noexcept;

}  // namespace engine
