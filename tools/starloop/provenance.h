#pragma once

#include <string>

namespace starloop {

/// What a measurement was made with: for tables that outlive the machine.
struct Provenance {
  std::string version;    ///< of the program
  std::string commit;     ///< of the sources, "-dirty" where they differ; "unknown" without git
  std::string processor;  ///< as the kernel calls it
  int processors = 0;     ///< online
};
[[nodiscard]] Provenance provenance();

}  // namespace starloop
