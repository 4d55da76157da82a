#pragma once

#include <vector>

#include "engine/orbit/file_segments.h"

namespace engine {

/// How a segment wants its rows to be joined.
enum class Interpolation : std::uint8_t {
  kHermite,   ///< places and velocities together
  kLagrange,  ///< each alone
};

/// What stands between two META_START: rows of one body, to be interpolated among themselves only.
struct OemSegment {
  SegmentMeta meta;
  Interpolation interpolation = Interpolation::kHermite;
  int degree = 7;  ///< of the polynomials
  std::vector<Epoch> times;
  std::vector<OrbitState> states;

  /// How many rows a polynomial needs.
  [[nodiscard]] std::size_t window() const noexcept {
    const auto terms = static_cast<std::size_t>(degree) + 1;
    return interpolation == Interpolation::kHermite ? (terms + 1) / 2 : terms;
  }
};
inline constexpr int kHighestDegree = 25;

/// An Orbit Ephemeris Message, CCSDS 502.0-B-2, in keyword = value notation; versions 1.0 to 3.0.
/// Frames EME2000, J2000, GCRF and ICRF, all taken for J2000: .023" between them, .8 m in low
/// orbit. Centre EARTH. TIME_SYSTEM UTC, TAI, TT or GPS. Without INTERPOLATION: Hermite of
/// degree 7. Left out: accelerations, covariances. The segments are in order of time and do not
/// overlap. Throws ConfigError: "file:line: what was expected, what was found".
[[nodiscard]] std::vector<OemSegment> read_oem(KvnLines lines);

}  // namespace engine
