#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace engine {

/// The number of a body by its name in a scenario: the target's is 0, that of the companion n - 1
/// of `companions` n; none: there is no such body.
[[nodiscard]] inline std::optional<std::size_t> body_number(
    const std::string& name, const std::vector<std::string>& companions) {
  if (name == "target") return 0;
  const auto it = std::ranges::find(companions, name);
  if (it == companions.end()) return std::nullopt;
  return static_cast<std::size_t>(it - companions.begin()) + 1;
}

}  // namespace engine
