#include "engine/scene/mesh_facing.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "engine/scene/mesh_outside.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Piece = MeshTopology::Piece;

/// A piece as it faces when all of it is turned to go with its first triangle.
struct Solid {
  Eigen::AlignedBox3d box;
  double volume_m3 = 0;    ///< signed
  double turned_m2 = 0;    ///< area that runs against the first triangle
  double unturned_m2 = 0;  ///< and that does not
};

Vector3d corner(const Mesh& mesh, std::uint32_t t, std::size_t k) {
  return mesh.vertices[mesh.triangles[t].corner[k]].cast<double>();
}

Solid solid_of(const Mesh& mesh, const Piece& piece) {
  Solid solid;
  // From a corner of its own: far from the body's origin the parts would cancel badly.
  const Vector3d origin = corner(mesh, piece.triangles.front(), 0);
  for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
    const std::uint32_t t = piece.triangles[i];
    const Vector3d a = corner(mesh, t, 0) - origin;
    const Vector3d b = corner(mesh, t, 1) - origin;
    const Vector3d c = corner(mesh, t, 2) - origin;
    const double area_m2 = 0.5 * (b - a).cross(c - a).norm();
    (piece.against[i] ? solid.turned_m2 : solid.unturned_m2) += area_m2;
    solid.volume_m3 += (piece.against[i] ? -1.0 : 1.0) * a.dot(b.cross(c)) / 6.0;
    for (const Vector3d& p : {a, b, c}) solid.box.extend(p + origin);
  }
  return solid;
}

double area_m2(const Solid& solid) noexcept { return solid.turned_m2 + solid.unturned_m2; }

/// Too flat for its volume to have a sign: two sheets back to back.
bool is_flat(const Solid& solid) noexcept {
  constexpr double kRounding = 1e-9;
  const double surface_m2 = area_m2(solid);
  return std::abs(solid.volume_m3) <= kRounding * surface_m2 * std::sqrt(surface_m2);
}

bool is_solid(const Piece& piece, const Solid& solid) noexcept {
  return piece.closed && !is_flat(solid);
}

bool faces_inwards_in_the_file(const Solid& solid) noexcept {
  return (solid.turned_m2 == 0.0 && solid.volume_m3 < 0.0) ||
         (solid.unturned_m2 == 0.0 && solid.volume_m3 > 0.0);
}

/// Those that others may be in, the largest first. Not those that are inside out in the file: there
/// it has lost its way, and what faces inwards in them says nothing of a cavity.
std::vector<Solid> hulls_of(const std::vector<Piece>& pieces, const std::vector<Solid>& solids) {
  constexpr std::size_t kEnough = 64;
  std::vector<Solid> hulls;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (pieces[i].two_sided && is_solid(pieces[i], solids[i]) &&
        !faces_inwards_in_the_file(solids[i]))
      hulls.push_back(solids[i]);
  std::ranges::stable_sort(hulls, [](const Solid& a, const Solid& b) {
    return std::abs(a.volume_m3) > std::abs(b.volume_m3);
  });
  if (hulls.size() > kEnough) hulls.resize(kEnough);
  return hulls;
}

bool may_be_cavity(const Solid& solid, const std::vector<Solid>& hulls) {
  return faces_inwards_in_the_file(solid) && std::ranges::any_of(hulls, [&](const Solid& hull) {
           return std::abs(hull.volume_m3) > std::abs(solid.volume_m3) &&
                  hull.box.contains(solid.box);
         });
}

/// By piece, those that are solid or have one side apart: kEither.
std::vector<MeshOutside::Side> outsides_of(const Mesh& mesh, const std::vector<Piece>& pieces,
                                           const std::vector<Solid>& solids) {
  std::vector<MeshOutside::Side> sides(pieces.size(), MeshOutside::Side::kEither);
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (pieces[i].two_sided && !pieces[i].closed && area_m2(solids[i]) > 0.0) open.push_back(i);
  if (open.empty()) return sides;
  std::ranges::stable_sort(
      open, [&](std::size_t a, std::size_t b) { return area_m2(solids[a]) > area_m2(solids[b]); });
  MeshOutside outside(mesh);
  for (const std::size_t i : open) sides[i] = outside.of(pieces[i]);
  return sides;
}

/// Whether to turn round what goes with the first triangle.
bool turns_first(const Piece& piece, const Solid& solid, MeshOutside::Side outside) noexcept {
  if (is_solid(piece, solid)) return solid.volume_m3 < 0.0;
  if (outside == MeshOutside::Side::kFirst) return false;
  return outside == MeshOutside::Side::kOther || solid.turned_m2 > solid.unturned_m2;
}

}  // namespace

Facing facing_of(const Mesh& mesh, const MeshTopology& topology) {
  const std::vector<Piece>& pieces = topology.pieces();
  std::vector<Solid> solids;
  solids.reserve(pieces.size());
  for (const Piece& piece : pieces) solids.push_back(solid_of(mesh, piece));
  const std::vector<Solid> hulls = hulls_of(pieces, solids);
  const std::vector<MeshOutside::Side> outsides = outsides_of(mesh, pieces, solids);

  Facing facing;
  facing.turn.assign(mesh.triangles.size(), false);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    const Solid& solid = solids[i];
    if (!piece.two_sided) {
      ++facing.one_sided;
      continue;
    }
    facing.closed_pieces += piece.closed ? 1 : 0;
    facing.not_looked += outsides[i] == MeshOutside::Side::kGaveUp ? 1U : 0U;
    const bool cavity = is_solid(piece, solid) && may_be_cavity(solid, hulls);
    if (is_solid(piece, solid))
      facing.volume_m3 += cavity ? -std::abs(solid.volume_m3) : std::abs(solid.volume_m3);
    if (cavity) continue;
    const bool turn_first = turns_first(piece, solid, outsides[i]);
    for (std::size_t k = 0; k < piece.triangles.size(); ++k)
      facing.turn[piece.triangles[k]] = piece.against[k] != turn_first;
  }
  return facing;
}

}  // namespace engine
