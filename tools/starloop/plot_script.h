#pragma once

#include <string>

namespace starloop {

/// Runs a script of tools/plot by Debian's own python3, the one that has python3-matplotlib, on a
/// file or a folder; `more` is its second argument, empty for none. False when it does not end
/// well.
bool run_plot_script(const std::string& name, const std::string& path,
                     const std::string& more = "");

}  // namespace starloop
