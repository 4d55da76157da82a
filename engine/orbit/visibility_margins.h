#pragma once

#include <cstdint>
#include <initializer_list>

#include "engine/orbit/sun_track.h"
#include "engine/orbit/visibility.h"

namespace engine {

/// Some of the conditions.
class Conditions {
 public:
  constexpr Conditions(std::initializer_list<Condition> list) noexcept {
    for (const Condition c : list) bits_ |= 1U << static_cast<unsigned>(c);
  }
  /// Those that a target must meet to be seen.
  [[nodiscard]] static Conditions needed(const VisibilitySpec& spec) noexcept;
  [[nodiscard]] constexpr bool has(Condition c) const noexcept {
    return (bits_ >> static_cast<unsigned>(c) & 1U) != 0;
  }

 private:
  std::uint32_t bits_ = 0;
};

/// How far a condition is from its edge at one instant.
struct Margin {
  double m = 0;  ///< as a way: below 0 it is not met
  double s = 0;  ///< no sooner than this can it change
};

/// All conditions together: the worst of them, and how long it stays on its side.
struct Margins {
  Margin all;
  Condition worst = Condition::kSpan;
};

/// The conditions as functions of time whose change is bounded: what steps through time may rely
/// on to miss nothing.
///
/// Each margin is a way that a body, or the line between both, must move to use it up. It moves no
/// further than its speed's bound allows, nor than its speed now and half the largest
/// acceleration times time squared: two bodies side by side part slowly, however fast they fly.
/// The acceleration is bounded by gravity at the ground, of the distance between two bodies by its
/// gradient there; with .1 m/s^2 for thrust. An orbit from a file whose speed jumps by more may
/// have an edge before it is expected. All positions geometric, no light time. Thread: one. The
/// propagators outlive it.
class VisibilityMargins {
 public:
  VisibilityMargins(const Propagator& camera, const Propagator& target, const VisibilitySpec& spec,
                    Conditions conditions) noexcept;

  [[nodiscard]] Margins at(Epoch t) noexcept;
  [[nodiscard]] const Propagator& camera() const noexcept { return camera_; }
  [[nodiscard]] const Propagator& target() const noexcept { return target_; }

 private:
  struct Moment;
  [[nodiscard]] Margin range(const Moment& now) const noexcept;
  [[nodiscard]] Margin line_of_sight(const Moment& now) const noexcept;
  [[nodiscard]] Margin sunlight(const Moment& now, const Position<J2000>& sun) const noexcept;
  [[nodiscard]] Margin sun_exclusion(const Moment& now, const Position<J2000>& sun) const noexcept;
  [[nodiscard]] Margin field(const Moment& now) const noexcept;
  [[nodiscard]] Margin signal(const Moment& now, const Position<J2000>& sun) const noexcept;
  [[nodiscard]] Margin earth_behind(const Moment& now) const noexcept;
  /// Of what changes as target and camera move against each other, and by a rate besides.
  [[nodiscard]] Margin by_relative_motion(double m, const Moment& now,
                                          double more_m_s) const noexcept;

  const Propagator& camera_;
  const Propagator& target_;
  VisibilitySpec spec_;
  Conditions conditions_;
  double fastest_body_m_s_;
  double fastest_approach_m_s_;
  SunTrack sun_;
};

}  // namespace engine
