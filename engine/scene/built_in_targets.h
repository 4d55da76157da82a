#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace engine {

/// The descriptions that are part of the program: data/targets/NAME.toml, see described_target.h.
[[nodiscard]] std::vector<std::string> built_in_targets();
/// The text of one; empty where there is none of that name.
[[nodiscard]] std::string_view built_in_target_text(const std::string& name) noexcept;

}  // namespace engine
