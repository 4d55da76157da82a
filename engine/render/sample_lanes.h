#pragma once

#include <array>
#include <cstdint>

#include "engine/render/embree_scene.h"
#include "engine/render/lamp_cone.h"
#include "engine/render/sobol.h"

namespace engine {

/// The same as PlaceSequence, SampleNumbers and LampCone, for a packet of rays at once: the widest
/// instructions that the processor has, and the same bits whichever those are.
/// Thread: any. Loop-safe.
struct SampleLanes {
  static constexpr std::size_t kLanes = RayPacket::kLanes;
  using Words = std::array<std::uint32_t, kLanes>;
  using Numbers = RayPacket::Lanes;

  alignas(64) Numbers first;
  alignas(64) Numbers second;

  /// Of sequences with these keys.
  void places(SequenceKind kind, const Words& key, const Words& sample) noexcept;
  /// The pair of this number of samples with these keys.
  void pairs(SequenceKind kind, const Words& key, const Words& sample,
             std::uint32_t number) noexcept;
  /// Towards places of a lamp, from the numbers: overwrites the packet's directions.
  void towards(const LampCone& lamp, RayPacket& rays) const noexcept;
};

}  // namespace engine
