#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/render/lamp_cone.h"
#include "engine/render/lattice_view.h"

namespace engine {

/// Points of a row of a lattice whose lamps' own views cannot tell light from shadow there: rays
/// ask. Of up to 32 points of a facet in a cell all ask, of more one in four, and the others where
/// these disagree.
/// Thread: one at a time. Loop-safe but for the constructor. What it is given outlives it.
class ShadowDoubts {
 public:
  /// Points of one facet in one cell.
  struct Doubt {
    std::size_t lamp = 0;
    std::uint32_t facet = 0;
    int column = 0;  ///< of the cell in the region
    int cell_row = 0;
    std::uint16_t points = 0;
    float beside_w_m2_sr = 0;  ///< what the points send in any case
    // Counted here.
    std::uint16_t asked = 0;
    std::uint16_t hidden = 0;
    /// Points in the light, when all is settled.
    [[nodiscard]] float lit() const noexcept {
      return static_cast<float>(points) * static_cast<float>(asked - hidden) /
             static_cast<float>(asked);
    }
  };
  /// A row of pixels: what its points see, by the lattice's stride.
  struct Row {
    std::span<const std::uint32_t> seen;
    int index = 0;
    std::array<Eigen::Vector3f, kLamps> toward_lamp;
  };

  ShadowDoubts(const LatticeView& view, const TracedTarget& target, std::size_t most);

  void start(const Row& row) noexcept;
  void add(const Doubt& doubt) noexcept;
  /// All answers.
  [[nodiscard]] std::span<const Doubt> settle() noexcept;
  /// Of this row.
  [[nodiscard]] const RayCounts& rays() const noexcept { return counts_; }

 private:
  /// Rays to one lamp, until they are a packet.
  struct Queue {
    RayPacket rays;
    std::array<std::uint32_t, RayPacket::kLanes> who{};  // index of a Doubt
    int used = 0;
  };
  void ask(std::size_t index, bool rest) noexcept;
  void send(std::size_t lamp) noexcept;

  const LatticeView& view_;
  const TracedTarget& target_;
  Row row_;
  std::vector<Doubt> doubts_;
  std::array<Queue, kLamps> queues_;
  RayCounts counts_;
};

}  // namespace engine
