#pragma once

#include "engine/core/time.h"
#include "engine/core/vec.h"

namespace engine {

struct OrbitState {
  Position<J2000> position;
  Velocity<J2000> velocity;
};

/// Both ends belong to it.
struct EpochSpan {
  Epoch begin = Epoch::min();
  Epoch end = Epoch::max();
};

/// Where a body is at an instant. One object per body; the two-body and the J2 model both fit here.
/// Thread: any. Loop-safe.
class Propagator {
 public:
  virtual ~Propagator() = default;
  /// Pre: t in span().
  [[nodiscard]] virtual OrbitState at(Epoch t) const noexcept = 0;
  /// When the model has an answer.
  [[nodiscard]] virtual EpochSpan span() const noexcept { return {}; }
  /// The body is never faster than this: a search for events may step as far as that allows.
  /// Escape speed at the ground covers every closed orbit above it.
  [[nodiscard]] virtual double speed_bound_m_s() const noexcept { return 11.2e3; }
};

}  // namespace engine
