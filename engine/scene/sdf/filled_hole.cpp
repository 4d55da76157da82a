#include "engine/scene/sdf/filled_hole.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace engine {

std::vector<Corners> filled_hole(const WorkMesh& mesh, const std::vector<std::uint32_t>& hole) {
  const std::size_t n = hole.size();
  std::vector<double> worst(n * n, 1.0);
  std::vector<std::size_t> best(n * n, 0);
  for (std::size_t span = 2; span < n; ++span) {
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t k = i + span;
      worst[i * n + k] = -1.0;
      for (std::size_t j = i + 1; j < k; ++j) {
        const double q =
            radius_ratio(mesh.place(hole[i]), mesh.place(hole[j]), mesh.place(hole[k]));
        const double all = std::min({q, worst[i * n + j], worst[j * n + k]});
        if (all <= worst[i * n + k]) continue;
        worst[i * n + k] = all;
        best[i * n + k] = j;
      }
    }
  }
  std::vector<Corners> fill;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k - i < 2) continue;
    const std::size_t j = best[i * n + k];
    fill.push_back({hole[i], hole[j], hole[k]});
    open.emplace_back(i, j);
    open.emplace_back(j, k);
  }
  return fill;
}

}  // namespace engine
