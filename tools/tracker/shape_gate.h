#pragma once

#include "engine/core/time.h"

namespace tracker {

/// Tells a target that moves from one that seems to, since a part of it cannot be seen.
///
/// Before a bright sky a surface that becomes as bright as the sky drops out of the silhouette and
/// takes its share of the centroid with it. Then the silhouette's area jumps in the same frame. A
/// target that manoeuvres keeps its area, one that comes closer changes it steadily. So a place is
/// not believed where it surprises by more than kSurprise of the silhouette's side and a pixel, and
/// the area is off its own trend by more than kJump; the pointing then goes on as it went. Both
/// limits widen while it does, and after kPatience_s the new shape is the target's. A track of
/// fewer than kToLearn measurements knows no trend yet: it believes.
/// Leaves out: a part that drops out slowly.
class ShapeGate {
 public:
  static constexpr double kJump = 0.04;      ///< of the area
  static constexpr double kSurprise = 0.03;  ///< of the square root of the area
  static constexpr double kPatience_s = 1.0;
  static constexpr int kToLearn = 8;

  /// One measurement: the silhouette's area, and how far it is from where it was expected.
  [[nodiscard]] bool believes(double area_px, double surprise_px, engine::SimTime when) noexcept;
  /// As before the first one.
  void forget() noexcept { learnt_ = 0; }

 private:
  int learnt_ = 0;       ///< measurements, kToLearn at most
  double log_area_ = 0;  ///< of the natural logarithm: growth is even there
  double rate_1_s_ = 0;
  engine::SimTime believed_{};  ///< when it was last
};

}  // namespace tracker
