#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace engine {

using Corners = std::array<std::uint32_t, 3>;

/// The Delaunay triangles of points in a plane (x and y; z is left alone), anticlockwise.
///
/// Points are inserted one by one and edges flipped (Lawson 1977, "Software for C1 surface
/// interpolation"). All tests are exact: they are made in whole numbers, on a lattice of 2^24 steps
/// to the longer side of the points' box. So it ends and its triangles fit together whatever the
/// points, rows and circles of them too. Of points that share a place on the lattice the first is
/// in, and points that are not finite are not. Along a hull whose points are in a row but for
/// rounding, flat triangles may be missing. Own code: of Debian's libraries CGAL is under the GPL,
/// and Qhull leaves by longjmp and moves points that are in rows.
[[nodiscard]] std::vector<Corners> delaunay(const std::vector<Eigen::Vector3d>& points);

}  // namespace engine
