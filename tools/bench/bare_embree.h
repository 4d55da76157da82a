#pragma once

#include <memory>
#include <span>

#include "engine/render/embree_scene.h"

/// Embree by itself, with nothing of ours round it but the copying of rays: what our own calls are
/// measured against.
class BareEmbree {
 public:
  explicit BareEmbree(const engine::Mesh& mesh);
  ~BareEmbree();
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  /// How many of the rays meet something.
  [[nodiscard]] std::size_t intersect(std::span<const engine::RayPacket> packets,
                                      engine::RayCoherence coherence) const;
  [[nodiscard]] std::size_t occluded(std::span<const engine::RayPacket> packets,
                                     engine::RayCoherence coherence) const;

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};
