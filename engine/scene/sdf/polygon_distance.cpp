#include "engine/scene/sdf/polygon_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace engine {

using Eigen::Vector2d;
using Eigen::Vector3d;

DistanceFunction polygon_distance(const std::vector<std::vector<Vector3d>>& loops_m) {
  struct Side {
    Vector2d a;
    Vector2d along;
  };
  std::vector<Side> sides;
  for (const auto& loop : loops_m) {
    if (loop.size() < 3) continue;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2d a = loop[i].head<2>();
      sides.push_back({a, loop[(i + 1) % loop.size()].head<2>() - a});
    }
  }
  return [sides](const Vector3d& p) {
    double nearest2 = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (const Side& s : sides) {
      const Vector2d from = p.head<2>() - s.a;
      const double length2 = s.along.squaredNorm();
      const double share = length2 > 0.0 ? std::clamp(from.dot(s.along) / length2, 0.0, 1.0) : 0.0;
      nearest2 = std::min(nearest2, (from - share * s.along).squaredNorm());
      // A ray to +x crosses sides that begin below it and end above, or the other way round.
      if ((from.y() < 0.0) != (from.y() < s.along.y()) &&
          (from.x() < s.along.x() * from.y() / s.along.y())) {
        inside = !inside;
      }
    }
    return inside ? -std::sqrt(nearest2) : std::sqrt(nearest2);
  };
}

}  // namespace engine
