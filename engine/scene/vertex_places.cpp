#include "engine/scene/vertex_places.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace engine {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

using Cell = std::array<std::int64_t, 3>;

/// Places in cells of a grid, chained by a hash of the cell. Cells may share a chain: all that
/// counts is the distance.
class Grid {
 public:
  Grid(std::span<const Eigen::Vector3f> vertices, double weld_m)
      : vertices_(vertices),
        weld2_m2_(weld_m * weld_m),
        // So wide that a place seldom has a neighbour in another cell, so narrow that a cell holds
        // few places that are further apart than the weld.
        cell_m_(weld_m > 0.0 ? 8.0 * weld_m : 1.0),
        reach_m_(weld_m),
        chains_(std::bit_ceil(vertices.size() + 1), kNone),
        next_(vertices.size(), kNone) {}

  /// The first place within the weld, or `i` itself, which then is one.
  [[nodiscard]] std::uint32_t find_or_add(std::uint32_t i) {
    if (!vertices_[i].allFinite()) return i;
    const Eigen::Vector3d p = vertices_[i].cast<double>();
    const std::uint32_t found = weld2_m2_ > 0.0 ? nearby(p) : in_chain(exact_hash(i), p);
    if (found != kNone) return found;
    std::uint32_t& chain = chain_of(weld2_m2_ > 0.0 ? cell_hash(cell_of(p)) : exact_hash(i));
    next_[i] = chain;
    chain = i;
    return i;
  }

 private:
  [[nodiscard]] static std::uint64_t mixed(std::uint64_t x) noexcept {
    // The finaliser of splitmix64 (Steele et al. 2014, DOI 10.1145/2660193.2660195).
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31);
  }
  [[nodiscard]] std::uint64_t exact_hash(std::uint32_t i) const noexcept {
    std::uint64_t h = 0;
    for (const float x : vertices_[i]) h = mixed(h + std::bit_cast<std::uint32_t>(x + 0.0F) + 1);
    return h;
  }
  [[nodiscard]] static std::uint64_t cell_hash(const Cell& cell) noexcept {
    std::uint64_t h = 0;
    for (const std::int64_t k : cell) h = mixed(h + static_cast<std::uint64_t>(k) + 1);
    return h;
  }
  [[nodiscard]] std::uint32_t& chain_of(std::uint64_t hash) noexcept {
    return chains_[hash & (chains_.size() - 1)];
  }

  [[nodiscard]] Cell cell_of(const Eigen::Vector3d& p) const noexcept {
    Cell cell;
    for (std::size_t k = 0; k < 3; ++k)
      cell[k] = static_cast<std::int64_t>(std::floor(p[static_cast<Eigen::Index>(k)] / cell_m_));
    return cell;
  }

  [[nodiscard]] std::uint32_t in_chain(std::uint64_t hash, const Eigen::Vector3d& p) noexcept {
    std::uint32_t first = kNone;
    for (std::uint32_t i = chain_of(hash); i != kNone; i = next_[i])
      if (i < first && (vertices_[i].cast<double>() - p).squaredNorm() <= weld2_m2_) first = i;
    return first;
  }

  /// In its cell, and in those that the weld reaches from it.
  [[nodiscard]] std::uint32_t nearby(const Eigen::Vector3d& p) noexcept {
    const Cell low = cell_of(p - Eigen::Vector3d::Constant(reach_m_));
    const Cell high = cell_of(p + Eigen::Vector3d::Constant(reach_m_));
    std::uint32_t first = kNone;
    Cell cell;
    for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0])
      for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1])
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2])
          first = std::min(first, in_chain(cell_hash(cell), p));
    return first;
  }

  std::span<const Eigen::Vector3f> vertices_;
  double weld2_m2_;
  double cell_m_;
  double reach_m_;
  std::vector<std::uint32_t> chains_;
  std::vector<std::uint32_t> next_;
};

}  // namespace

std::vector<std::uint32_t> first_at_place(std::span<const Eigen::Vector3f> vertices,
                                          double weld_m) {
  Grid grid(vertices, weld_m);
  std::vector<std::uint32_t> first(vertices.size());
  for (std::uint32_t i = 0; i < vertices.size(); ++i) first[i] = grid.find_or_add(i);
  return first;
}

}  // namespace engine
