#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace engine {

/// Cuts a face of three corners or more into triangles that cover it; each runs as the face does.
///
/// A quad along its shorter diagonal, or the one that stays inside where it is dented; more corners
/// by clipping ears. The same corners from another one on give the same triangles, so that a face
/// written twice can be told. A corner at the place of the next one is passed over: it pads a
/// triangle to a quad. Appends indices into `corners`. False: the face crosses itself; then the
/// triangles are as many, and that is all. So they are of a face with a corner that is no number,
/// and each such corner is in one of them.
///
/// Takes time as the square of the corners at most.
///
/// Source of the ears: Meisters 1975, Polygons have ears, DOI 10.2307/2319703.
[[nodiscard]] bool cut_polygon(std::span<const Eigen::Vector3f> corners,
                               std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace engine
