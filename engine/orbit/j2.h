#pragma once

#include <vector>

#include "engine/core/constants.h"
#include "engine/orbit/propagator.h"
#include "engine/orbit/taylor_leg.h"

namespace engine {

/// Of the Earth's field: the point mass and the bulge round its equator.
struct OblateEarth {
  double mu_m3_s2 = kEarthMu_m3_s2;
  double j2 = 1.08262668e-3;  ///< EGM96, unnormalised
  double radius_m = kEarthRadius_m;
};

/// Kinetic and potential, of a kilogramme: what motion about an oblate Earth keeps.
[[nodiscard]] double energy_j_kg(const OrbitState& state, const OblateEarth& earth = {}) noexcept;

/// Motion about an oblate Earth, integrated once over a span: Vallado 2013, Fundamentals of
/// Astrodynamics, eq 8-30, the axis of the bulge being J2000's pole.
///
/// Taylor series of order 24 by recurrence (Jorba & Zou 2005, Experimental Mathematics 14): each
/// step is as long as its last terms are below the rounding, an eighth of a low orbit, and its
/// polynomial is kept. So at() is the integration itself, not an interpolation of it.
/// Error against the exact motion in this field: 1e-3 m after 15 days, energy and the polar angular
/// momentum to 1e-13. 15 days of a low orbit take some 5 ms and 1.2 MB.
/// Leaves out: the higher zonals, 1-2 km after a day, 30 km after 15; drag, as far in a low orbit;
/// tides, Moon and Sun; the pole's precession, 2" a decade.
class J2Propagator final : public Propagator {
 public:
  /// Pre: the state is finite and stays above the Earth's surface; epoch in span.
  J2Propagator(const OrbitState& state, Epoch epoch, const EpochSpan& span,
               const OblateEarth& earth = {});

  /// Beyond its span the body stands still at the span's end.
  [[nodiscard]] OrbitState at(Epoch t) const noexcept override;
  [[nodiscard]] EpochSpan span() const noexcept override { return span_; }
  [[nodiscard]] double speed_bound_m_s() const noexcept override { return fastest_m_s_; }

  /// Of the integration, both ways.
  [[nodiscard]] std::size_t steps() const noexcept { return legs_.size(); }

 private:
  static constexpr std::size_t kOrder = 24;

  using Terms = TaylorLeg<3, kOrder>;
  struct Leg {
    Epoch origin;
    Terms m;

    [[nodiscard]] OrbitState at(Epoch t) const noexcept;
  };
  [[nodiscard]] static Terms expand(const OrbitState& state, const OblateEarth& earth) noexcept;
  /// Legs from a state until `end`, in the order of their making. Either way in time.
  [[nodiscard]] std::vector<Leg> integrate(OrbitState state, Epoch t, Epoch end,
                                           const OblateEarth& earth);

  EpochSpan span_;
  double fastest_m_s_ = 0;
  std::vector<Epoch> begins_;  ///< of the legs, in order of time
  std::vector<Leg> legs_;
};

}  // namespace engine
