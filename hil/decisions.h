#pragma once

#include <cstdint>
#include <vector>

#include "hil/loop_report.h"

namespace hil {

/// What a clock, a link and the software under test decided in a run: with scenario and seed, all
/// that its pixels depend on. A loop that is given them asks nobody else.
struct Decisions {
  /// A frame that the loop came to. One that is missing was skipped.
  struct Due {
    std::uint64_t frame = 0;
    bool exposed = false;  ///< false: dropped; commands were obeyed all the same
    int passes = 0;        ///< of rendering, where a clock said when to stop; 0: none did
    engine::Shed shed = engine::Shed::kNothing;  ///< left out, where a clock said so
  };
  std::vector<Due> due;                 ///< by frame, ascending
  std::vector<CommandRecord> commands;  ///< in the order in which they were obeyed
};

}  // namespace hil
