#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/orbit/sun.h"

namespace engine {

/// Where the Sun is, again and again: for searches, which ask more often than it moves.
///
/// A cubic through four of sun_position()'s places, 3 h apart at fixed times: what it answers
/// depends on the time alone. Its error, .0234 h^4 of the fourth derivative, is 0.15 m or 1e-12
/// rad: the year's motion and the Moon's pull on the Earth have equal parts in it. A shadow's edge
/// at the height of low orbits is 1 ns off by that. Thread: one. Loop-safe.
class SunTrack {
 public:
  explicit SunTrack(SunModel model) noexcept : model_(model) {
    nodes_.fill(Eigen::Vector3d::Zero());
  }
  [[nodiscard]] Position<J2000> at(Epoch t) noexcept;

 private:
  static constexpr Duration kStep = std::chrono::hours(3);
  static constexpr std::size_t kNodes = 4;

  [[nodiscard]] Eigen::Vector3d node(std::int64_t step) const noexcept;

  SunModel model_;
  std::int64_t step_ = std::numeric_limits<std::int64_t>::min();  ///< that the nodes are around
  std::array<Eigen::Vector3d, kNodes> nodes_;
};

}  // namespace engine
