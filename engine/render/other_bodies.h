#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace engine {

struct TracedTarget;

/// What a scene has besides the target, in the snapshot's order. Some may share their TracedTarget,
/// also with the target.
struct OtherBodies {
  struct Part {
    std::shared_ptr<TracedTarget> shape;
    std::size_t owner = 0;  ///< 0: the target, n: companion n - 1
  };
  std::vector<std::shared_ptr<TracedTarget>> companions{};
  std::vector<Part> parts{};

  [[nodiscard]] bool empty() const noexcept { return companions.empty() && parts.empty(); }
};

}  // namespace engine
