#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace engine {

/// For each vertex the first one that is not further from it than `weld_m`; itself when there is
/// none. Only a vertex that stands for itself is stood for: none moves further than that.
///
/// Takes time in proportion to the vertices, however they lie. A vertex that is no number stands
/// for itself. Pre: weld_m >= 0; at 0 the same three numbers are one place (and -0 is 0).
[[nodiscard]] std::vector<std::uint32_t> first_at_place(std::span<const Eigen::Vector3f> vertices,
                                                        double weld_m);

}  // namespace engine
