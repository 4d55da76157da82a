#include "engine/scene/mesh_topology.h"

#include <algorithm>

namespace engine {
namespace {

struct Side {
  std::uint64_t edge;
  std::uint32_t index;  ///< 3 triangle + corner that it starts from
};

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) noexcept {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

std::uint32_t start_of(const Mesh& mesh, std::uint32_t side) noexcept {
  return mesh.triangles[side / 3].corner[side % 3];
}

std::vector<Side> sorted_sides(const Mesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corner = mesh.triangles[t].corner;
    for (std::uint32_t k = 0; k < 3; ++k)
      sides.push_back({edge_key(corner[k], corner[(k + 1) % 3]), 3 * t + k});
  }
  std::ranges::sort(sides, [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.index < b.index;
  });
  return sides;
}

}  // namespace

MeshTopology::MeshTopology(const Mesh& mesh) : across_(3 * mesh.triangles.size(), kNone) {
  pair_edges(mesh);
  std::vector<std::uint32_t> piece_of(mesh.triangles.size(), kNone);
  std::vector<bool> against(mesh.triangles.size(), false);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (piece_of[t] == kNone) gather_piece(mesh, t, piece_of, against);
}

void MeshTopology::pair_edges(const Mesh& mesh) {
  const std::vector<Side> sides = sorted_sides(mesh);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].edge == sides[i].edge) ++end;
    ++edges_;
    if (end - i == 2) {
      across_[sides[i].index] = sides[i + 1].index;
      across_[sides[i + 1].index] = sides[i].index;
    } else {
      const std::uint64_t edge = sides[i].edge;
      odd_edges_.push_back(
          {{static_cast<std::uint32_t>(edge >> 32), static_cast<std::uint32_t>(edge)},
           sides[i].index / 3,
           static_cast<std::uint32_t>(end - i)});
    }
    i = end;
  }
}

void MeshTopology::gather_piece(const Mesh& mesh, std::uint32_t seed,
                                std::vector<std::uint32_t>& piece_of, std::vector<bool>& against) {
  Piece piece;
  const auto number = static_cast<std::uint32_t>(pieces_.size());
  piece_of[seed] = number;
  piece.triangles.push_back(seed);
  for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
    const std::uint32_t t = piece.triangles[i];
    for (std::uint32_t side = 3 * t; side < 3 * t + 3; ++side) {
      const std::uint32_t other_side = across_[side];
      if (other_side == kNone) {
        piece.closed = false;
        continue;
      }
      // Neighbours that face alike run along their edge in opposite ways.
      const bool alike = start_of(mesh, side) != start_of(mesh, other_side);
      const std::uint32_t other = other_side / 3;
      const bool other_against = alike ? against[t] : !against[t];
      if (piece_of[other] == kNone) {
        piece_of[other] = number;
        against[other] = other_against;
        piece.triangles.push_back(other);
      } else if (against[other] != other_against) {
        piece.two_sided = false;
      }
    }
  }
  std::ranges::sort(piece.triangles);
  piece.against.reserve(piece.triangles.size());
  for (const std::uint32_t t : piece.triangles) piece.against.push_back(against[t]);
  pieces_.push_back(std::move(piece));
}

}  // namespace engine
