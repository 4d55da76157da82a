#pragma once

#include <vector>

#include <Eigen/Core>

#include "engine/scene/sdf/solid.h"

namespace engine {

/// The exact distance to the nearest side of closed polygons in the plane z = 0; negative where an
/// odd number of them is round the place. Loops of fewer than three places are left out.
[[nodiscard]] DistanceFunction polygon_distance(
    const std::vector<std::vector<Eigen::Vector3d>>& loops_m);

}  // namespace engine
