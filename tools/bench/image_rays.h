#pragma once

#include <cstddef>
#include <vector>

#include "engine/render/embree_scene.h"
#include "engine/render/traced_target.h"
#include "engine/scene/camera_geometry.h"
#include "engine/scene/snapshot.h"

namespace bench {

/// Rays in packets, in the order in which a renderer would have them.
class Packets {
 public:
  void add(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction);
  [[nodiscard]] const std::vector<engine::RayPacket>& all() const { return all_; }
  [[nodiscard]] double rays() const { return static_cast<double>(rays_); }

 private:
  std::vector<engine::RayPacket> all_;
  int used_ = 0;
  std::size_t rays_ = 0;
};

/// The rays that an image of a target is made of.
struct ImageRays {
  Packets camera;
  Packets shadow;  ///< to the Sun, from where camera rays hit
  Packets bounce;  ///< from one in seven of those, by the cosine law
  Packets bounce_shadow;
};

/// So many samples in each pixel where the target can be.
[[nodiscard]] ImageRays rays_of(const engine::TracedTarget& target,
                                const engine::Snapshot& snapshot,
                                const engine::CameraGeometry& camera, int samples);

}  // namespace bench
