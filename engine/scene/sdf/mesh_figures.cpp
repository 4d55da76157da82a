#include "engine/scene/sdf/mesh_figures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "engine/scene/sdf/work_mesh.h"

namespace engine {

using Eigen::Vector3d;

MeshFigures figures_of(const std::vector<Vector3d>& places_m, const std::vector<Corners>& triangles,
                       const DistanceFunction& f) {
  MeshFigures out;
  out.triangles = triangles.size();
  out.smallest_quality = triangles.empty() ? 0.0 : 1.0;
  std::vector<bool> used(places_m.size(), false);
  struct Walks {
    int up = 0;
    int down = 0;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Walks> walked;
  const auto measure = [&](const Vector3d& p) {
    if (f) out.off_m = std::max(out.off_m, std::abs(f(p)));
  };
  for (const Corners& t : triangles) {
    const Vector3d& a = places_m[t[0]];
    const Vector3d& b = places_m[t[1]];
    const Vector3d& c = places_m[t[2]];
    const double q = radius_ratio(a, b, c);
    out.smallest_quality = std::min(out.smallest_quality, q);
    out.mean_quality += q / static_cast<double>(triangles.size());
    ++out.histogram[std::min(MeshFigures::kBins - 1,
                             static_cast<std::size_t>(q * MeshFigures::kBins))];
    const Vector3d area = area_vector(a, b, c);
    out.area_m2 += area.norm();
    out.volume_m3 += a.dot(area) / 3.0;
    measure((a + b + c) / 3.0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t from = t[i];
      const std::uint32_t to = t[(i + 1) % 3];
      used[from] = true;
      Walks& w = walked[std::minmax(from, to)];
      ++(from < to ? w.up : w.down);
    }
  }
  for (const auto& [edge, walks] : walked) {
    if (walks.up + walks.down == 1) {
      ++out.rims;
    } else if (walks.up != 1 || walks.down != 1) {
      ++out.tangled;
    }
    measure(0.5 * (places_m[edge.first] + places_m[edge.second]));
  }
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) measure(places_m[v]);
  out.edges = walked.size();
  out.vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  out.euler = static_cast<int>(out.vertices) - static_cast<int>(out.edges) +
              static_cast<int>(out.triangles);
  return out;
}

}  // namespace engine
