#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/grouped_mesh.h"
#include "engine/scene/mesh_report.h"

namespace engine {

/// Mends what a mesh from outside has wrong as far as it can be done without a change to the image,
/// and counts the rest. `line` is the file's, by triangle; empty for a mesh without a file.
///
/// In this order:
/// 1. Faces with a corner that is no number, or 1000 km away, are left out as a whole.
/// 2. Vertices closer than a millionth of the mesh's size become one, the first: of the six digits
///    that exporters write, corners that were one come out that far apart. On a body of 10 m that
///    is some 10 um, under half a foil. Size is the median distance from the median vertex: one
///    stray corner far out does not weld all the others.
/// 3. Faces on three corners that an earlier one has are left out, either side up: rays would meet
///    one or the other by chance.
/// 4. In a piece (triangles joined by edges of two) all are turned to face alike: outwards where it
///    is closed, and where it is open to the side that sees more of the sky, or as most of its area
///    does. A closed piece that is inside out
///    within the box of another that is not is left: it may be the wall of a cavity. A piece with
///    one side only is left.
/// 5. Triangles lower than the weld are left out: no ray meets them, and an intersector may go
///    wrong on them. Edges are counted before, as such a one may close a gap.
/// 6. Vertices and materials that nothing uses any more go.
/// Order is kept in everything. A mesh that has nothing wrong comes out as it went in.
///
/// Open and non-manifold edges, vertices in the middle of another face's open edge, and slivers are
/// counted and left: a shell of sheets is as good a target as a solid, shading is two-sided.
/// Leaves out: faces that overlap in a plane without the same corners; holes are not closed. Throws
/// nothing; a mesh may come out empty.
void repair(GroupedMesh& grouped, std::vector<std::uint32_t> line, MeshReport& report);

}  // namespace engine
