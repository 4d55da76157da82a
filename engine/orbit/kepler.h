#pragma once

#include "engine/orbit/elements.h"

namespace engine {

struct EccentricAnomaly {
  double rad = 0;          ///< E in [-pi, pi]; of a hyperbola H, which is no angle
  int iterations = 0;      ///< at most kMostKeplerIterations
  bool converged = false;  ///< to the rounding; false only where M is not finite
};
inline constexpr int kMostKeplerIterations = 60;

/// Solves M = E - e sin E for 0 <= e < 1 and any finite M.
///
/// Halley's steps, kept inside the bracket [M, M + e] of the half turn M >= 0: Newton's alone
/// diverges for 20 % of M at e = 1 - 1e-12. E - sin E comes from its series where it cancels.
/// E(-M) = -E(M) to the bit. Error: 5e-14 relative, in at most five iterations.
[[nodiscard]] EccentricAnomaly solve_kepler(double eccentricity, double mean_anomaly_rad) noexcept;

/// Solves M = e sinh H - H for e > 1 and any finite M.
///
/// The same steps inside the bracket from asinh(M / e) to the lesser of asinh(M / (e - 1)) and
/// cbrt(6 M / e): no sinh overflows there. Near the parabola the start is the cubic's root, as for
/// the ellipse. H(-M) = -H(M) to the bit. Error: 1e-13 relative, in at most six iterations.
[[nodiscard]] EccentricAnomaly solve_hyperbolic_kepler(double eccentricity,
                                                       double mean_anomaly_rad) noexcept;

/// The same equations, read the other way: M of E where e < 1, of H where e > 1, without
/// cancellation.
[[nodiscard]] double mean_anomaly_rad(double eccentricity, double eccentric_anomaly_rad) noexcept;

/// Two-body motion on an ellipse or a hyperbola: eq 1 of Li et al. 2023; Vallado 2013, section 2.2.
/// Leaves out everything but a point mass: oblateness alone is worth 1.6 km after ten minutes.
/// Error against the exact two-body motion: 1e-5 m after a day, 1e-4 m after 15 days in low orbit;
/// near the parabola the rounding of e adds 1e-9 m / |1 - e|.
class KeplerPropagator final : public Propagator {
 public:
  /// Pre: the semi-major axis has the eccentricity's sign, and e is not 1.
  KeplerPropagator(const KeplerElements& elements, Epoch epoch,
                   double mu_m3_s2 = kEarthMu_m3_s2) noexcept;

  [[nodiscard]] OrbitState at(Epoch t) const noexcept override;
  /// That of the perigee.
  [[nodiscard]] double speed_bound_m_s() const noexcept override;

 private:
  [[nodiscard]] OrbitState on_ellipse(double mean_anomaly) const noexcept;
  [[nodiscard]] OrbitState on_hyperbola(double mean_anomaly) const noexcept;

  KeplerElements elements_;
  Epoch epoch_;
  double mean_motion_rad_s_;
  Eigen::Vector3d toward_perigee_;      ///< unit
  Eigen::Vector3d quarter_turn_ahead_;  ///< unit, in the orbit's plane
};

}  // namespace engine
