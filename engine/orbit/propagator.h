#pragma once

#include "engine/core/time.h"
#include "engine/core/vec.h"

namespace engine {

struct OrbitState {
  Position<J2000> position;
  Velocity<J2000> velocity;
};

/// Where a body is at an instant. One object per body; the two-body and the J2 model both fit here.
/// Thread: any. Loop-safe.
class Propagator {
 public:
  virtual ~Propagator() = default;
  [[nodiscard]] virtual OrbitState at(Epoch t) const noexcept = 0;
};

}  // namespace engine
