#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "engine/core/vec.h"

namespace engine {

/// Which stars a scenario shows.
struct StarSpec {
  enum class Source : std::uint8_t { kNone, kBuiltIn, kFile };
  Source source = Source::kNone;
  std::string path;
  std::string where;            ///< the place in the scenario that names it
  double limit_magnitude = 99;  ///< fainter ones are left out
  double colour_b_v = 0.61;     ///< of stars without one: the median of XHIP
};
[[nodiscard]] StarSpec read_stars(const ConfigTable& table);

struct CatalogueStar {
  Eigen::Vector3d unit = Eigen::Vector3d::UnitZ();  ///< J2000 axes, from the solar system
  float v_magnitude = 0;
  float colour_b_v = std::numeric_limits<float>::quiet_NaN();  ///< not a number: unknown
};

/// The stars of a catalogue where they stand at one epoch, and what is not known of them.
///
/// Built in (data/stars.bin, made by tools/make_star_catalogue.py): 900 537 stars to V = 11 from
/// Tycho-2 and Hipparcos, places at J2000 to 5 mas, V to .005. 13 % have their colour, 32 their
/// proper motion. At V = 11 crowded fields, 2.7 % of the sky, may lack stars: the source has the
/// ten brightest of each 0.14 square degrees. Motion is along a straight line at even speed. Leaves
/// out: what the star's coming nearer does to it (0.5" for Barnard's star over 27 years), orbits of
/// double stars.
struct StarCatalogue {
  std::vector<CatalogueStar> stars;
  std::size_t without_motion = 0;
  std::size_t without_colour = 0;
  double years = 0;  ///< from the catalogue's epoch to this one

  /// How far the stars without a known motion have moved, half of them further.
  [[nodiscard]] double median_error_rad() const noexcept;
};

/// Julian years after J2000.
[[nodiscard]] double years_after_j2000(Epoch t) noexcept;

/// Reads what `spec` names, a table if it is a file: its first line names the columns, in any
/// order: ra_deg, dec_deg, mag; and, if the user likes, b_v or bp_rp (mag is then Gaia's G),
/// pmra_mas_yr (times cos dec) and pmdec_mas_yr, epoch (Julian year, otherwise 2000). Colour,
/// motion and epoch may stand empty. Lines that begin with # do not count. A file that begins with
/// "SLSTARS1" is one of tools/make_star_catalogue.py instead. Throws ConfigError: "path:line:
/// complaint".
[[nodiscard]] StarCatalogue read_star_catalogue(const StarSpec& spec, Epoch epoch);

/// The binary form, little-endian: "SLSTARS1", u32 zones (120), u32 cells at the equator (240), u32
/// stars, u32 motions, f64 epoch (Julian year); u32 stars of each cell; u64 for each star; for each
/// motion u32 star and f32 mas/yr in right ascension (times cos dec) and declination.
/// A zone is a band of declination from the south on; it has floor(240 cos dec + .5) cells of right
/// ascension, at least one. A star's bits from the lowest: 20 for its place in the cell along right
/// ascension, 20 along declination, 12 for V in .005 from -2, 8 for B-V in .025 from -.5 (255:
/// none).
[[nodiscard]] StarCatalogue decode_stars(std::span<const unsigned char> bytes,
                                         const std::string& name, const StarSpec& spec,
                                         Epoch epoch);

}  // namespace engine
