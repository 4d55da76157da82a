#include "engine/orbit/sun_track.h"

#include <algorithm>

namespace engine {

Eigen::Vector3d SunTrack::node(std::int64_t step) const noexcept {
  return sun_position(model_, Epoch(step * kStep)).m;
}

Position<J2000> SunTrack::at(Epoch t) noexcept {
  const Duration since = t.time_since_epoch();
  const std::int64_t step = since / kStep - (since % kStep < Duration::zero() ? 1 : 0);
  if (step == step_ + 1) {
    std::rotate(nodes_.begin(), nodes_.begin() + 1, nodes_.end());
    nodes_.back() = node(step + 2);
  } else if (step != step_) {
    for (std::size_t i = 0; i < kNodes; ++i)
      nodes_[i] = node(step - 1 + static_cast<std::int64_t>(i));
  }
  step_ = step;
  // Lagrange's, for nodes at -1, 0, 1 and 2.
  const double x = seconds(since - step * kStep) / seconds(kStep);
  return {-x * (x - 1.0) * (x - 2.0) / 6.0 * nodes_[0] +
          (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0 * nodes_[1] -
          (x + 1.0) * x * (x - 2.0) / 2.0 * nodes_[2] +
          (x + 1.0) * x * (x - 1.0) / 6.0 * nodes_[3]};
}

}  // namespace engine
