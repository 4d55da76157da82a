#pragma once

#include <string>

#include "engine/core/config_reader.h"

namespace hil {

/// What a run asks of the system when it keeps real time.
struct RealtimeSpec {
  int priority = 10;        ///< SCHED_FIFO, of the loop; 0: not asked for
  int core = -1;            ///< that the loop is pinned to; -1: any
  bool lock_memory = true;  ///< all that set-up has allocated and touched
};
/// Keys `priority`, `core`, `lock_memory`, all optional.
[[nodiscard]] RealtimeSpec read_realtime(const engine::ConfigTable& table);

/// What the system gave.
struct RealtimeGrant {
  int priority = 0;  ///< 0: the ordinary one
  int core = -1;
  bool memory_locked = false;
  /// One line: each thing that was asked for, and whether it was given.
  std::string text;
};

/// Asks for the calling thread's priority and core, and for the process's memory. Call it after
/// set-up: memory allocated later is not locked, because a limit would then make allocations fail.
/// Workers that exist already keep their ordinary priority: rendering must not starve the software
/// under test on the same machine.
/// Nothing that is refused is an error.
[[nodiscard]] RealtimeGrant enter_realtime(const RealtimeSpec& spec);

/// Gives back what enter_realtime() got, for what comes after the loop.
void leave_realtime(const RealtimeGrant& grant) noexcept;

/// SCHED_FIFO at `priority` for the calling thread, not for threads and programs that it starts;
/// false when the system says no.
bool raise_priority(int priority) noexcept;

}  // namespace hil
