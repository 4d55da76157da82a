#pragma once

#include <string>
#include <vector>

namespace corners {

/// A place where a plain method fails, and what ours makes of it, both measured on the spot.
///
/// Each figure is an error: how far a result is from what it must be, at the worst of the inputs
/// that were tried. The plain method is the one that a textbook or the literature gives for the
/// easy case, written out beside the measurement; ours is the program's own code.
struct Corner {
  std::string regime;  ///< where it is
  std::string plain;   ///< the plain method
  double plain_error = 0;
  double our_error = 0;
  double bound = 0;  ///< that our error must keep
  std::string unit;
  std::string why;  ///< what is measured, where the bound comes from, and the literature

  /// False for what is no number.
  [[nodiscard]] bool met() const noexcept { return our_error <= bound; }
  /// The plain method fails here: unless, the row shows nothing.
  [[nodiscard]] bool shows() const noexcept { return !(plain_error <= bound); }
};

/// The corners of one part of the program. Pure functions of nothing: the same figures each time.
struct Room {
  std::string name;
  std::vector<Corner> corners;
};

[[nodiscard]] Room kepler_corners();
[[nodiscard]] Room orbit_corners();
[[nodiscard]] Room visibility_corners();
[[nodiscard]] Room attitude_corners();
[[nodiscard]] Room scene_corners();
[[nodiscard]] Room render_corners();
[[nodiscard]] Room optics_corners();
[[nodiscard]] Room detector_corners();
[[nodiscard]] Room loop_corners();

/// All of them, in the order of the data's flow. Takes seconds.
[[nodiscard]] std::vector<Room> all_corners();

}  // namespace corners
