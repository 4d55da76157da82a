#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/scene/mesh.h"

namespace engine {

/// How the triangles of a mesh hang together by their edges. Vertices are told apart by their
/// index: weld first.
class MeshTopology {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Triangles with two equal corners must have gone.
  explicit MeshTopology(const Mesh& mesh);

  struct Edge {
    std::array<std::uint32_t, 2> vertex{};  ///< the lower one first
    std::uint32_t triangle = 0;             ///< the first that has it
    std::uint32_t uses = 0;
  };
  /// Those that are not of two triangles.
  [[nodiscard]] const std::vector<Edge>& odd_edges() const noexcept { return odd_edges_; }
  [[nodiscard]] std::size_t edges() const noexcept { return edges_; }

  /// Triangles that can be reached from each other over edges of two triangles.
  struct Piece {
    std::vector<std::uint32_t> triangles;  ///< rising
    std::vector<bool> against;  ///< by place in `triangles`: runs against the first of them
    bool closed = true;         ///< no edge of one or of many triangles
    bool two_sided = true;      ///< no way round it turns a triangle over
  };
  [[nodiscard]] const std::vector<Piece>& pieces() const noexcept { return pieces_; }

 private:
  void pair_edges(const Mesh& mesh);
  void gather_piece(const Mesh& mesh, std::uint32_t seed, std::vector<std::uint32_t>& piece_of,
                    std::vector<bool>& against);

  std::size_t edges_ = 0;
  std::vector<Edge> odd_edges_;
  std::vector<std::uint32_t> across_;  ///< by side (3 triangle + corner): that of the neighbour
  std::vector<Piece> pieces_;
};

}  // namespace engine
