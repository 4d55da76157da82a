#pragma once

#include "engine/orbit/propagator.h"

namespace engine {

/// A place beside a body: away from the Earth, ahead, and to the side of the orbit's normal.
struct OrbitalOffset {
  double radial_m = 0;
  double along_m = 0;
  double cross_m = 0;
};

/// A body that keeps its place beside another in that one's orbital frame.
///
/// Not a free orbit but for small offsets along the track of a circle: something holds it there, be
/// it a truss or its thrusters. The frame turns with the leader: exact for two-body motion.
/// Pre: the leader's motion is not radial. The leader outlives it.
class HeldOffset final : public Propagator {
 public:
  HeldOffset(const Propagator& leader, const OrbitalOffset& offset) noexcept;

  [[nodiscard]] OrbitState at(Epoch t) const noexcept override;
  [[nodiscard]] EpochSpan span() const noexcept override { return leader_.span(); }

 private:
  const Propagator& leader_;
  Position<OrbitalFrame> offset_;
};

}  // namespace engine
