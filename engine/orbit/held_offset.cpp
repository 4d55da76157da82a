#include "engine/orbit/held_offset.h"

#include "engine/orbit/attitude.h"

namespace engine {

HeldOffset::HeldOffset(const Propagator& leader, const OrbitalOffset& offset) noexcept
    : leader_(leader), offset_{{offset.along_m, -offset.cross_m, -offset.radial_m}} {}

OrbitState HeldOffset::at(Epoch t) const noexcept {
  OrbitState state = leader_.at(t);
  const Eigen::Vector3d beside_m = (orbital_frame(state).inverse() * offset_).m;
  const Eigen::Vector3d turn_rad_s =
      state.position.m.cross(state.velocity.m_s) / state.position.m.squaredNorm();
  state.position.m += beside_m;
  state.velocity.m_s += turn_rad_s.cross(beside_m);
  return state;
}

}  // namespace engine
