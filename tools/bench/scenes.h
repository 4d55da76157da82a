#pragma once

#include <string>
#include <vector>

#include "tools/starloop/scenario.h"

namespace bench {

/// A scenario of config/, as table.key=value change it.
[[nodiscard]] starloop::Scenario scenario_of(const std::string& name,
                                             const std::vector<std::string>& overrides = {});

/// When the paper's pass is at its closest: seconds after the epoch of config/flyby.toml.
inline constexpr double kClosest_s = 309781.706;

}  // namespace bench
