#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/orbit/propagator.h"

namespace engine {

/// An ellipse about the Earth. Angles in radians, J2000.
struct KeplerElements {
  double semi_major_axis_m = 7e6;
  double eccentricity = 0;  ///< in [0, 1)
  double inclination_rad = 0;
  double argument_of_perigee_rad = 0;
  double raan_rad = 0;
  double mean_anomaly_rad = 0;  ///< at the epoch
};

[[nodiscard]] KeplerElements read_elements(const ConfigTable& table);

struct EccentricAnomaly {
  double rad = 0;      ///< in [-pi, pi]
  int iterations = 0;  ///< at most kMostKeplerIterations
};
inline constexpr int kMostKeplerIterations = 60;

/// Solves M = E - e sin E for 0 <= e < 1 and any finite M.
///
/// Halley's steps, kept inside the bracket [M, M + e] of the half turn M >= 0: Newton's alone
/// diverges for 20 % of M at e = 1 - 1e-12. E - sin E comes from its series where it cancels.
/// E(-M) = -E(M) to the bit. Error: 5e-14 relative.
[[nodiscard]] EccentricAnomaly solve_kepler(double eccentricity, double mean_anomaly_rad) noexcept;

/// Two-body motion: eq 1 of Li et al. 2023.
/// Leaves out everything but a point mass: oblateness alone is worth 1.6 km after ten minutes.
/// Error against the exact two-body motion: 1e-5 m after a day, 1e-4 m after 15 days.
class KeplerPropagator final : public Propagator {
 public:
  KeplerPropagator(const KeplerElements& elements, Epoch epoch,
                   double mu_m3_s2 = kEarthMu_m3_s2) noexcept;

  [[nodiscard]] OrbitState at(Epoch t) const noexcept override;

 private:
  KeplerElements elements_;
  Epoch epoch_;
  double mean_motion_rad_s_;
  Eigen::Vector3d toward_perigee_;      ///< unit
  Eigen::Vector3d quarter_turn_ahead_;  ///< unit, in the orbit's plane
};

}  // namespace engine
