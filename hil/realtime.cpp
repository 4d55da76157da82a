#include "hil/realtime.h"

#include <cerrno>
#include <cstring>

#include <sched.h>
#include <sys/mman.h>

namespace hil {
namespace {

std::string refusal(int error) { return std::string("refused (") + std::strerror(error) + ")"; }

}  // namespace

RealtimeSpec read_realtime(const engine::ConfigTable& table) {
  RealtimeSpec spec;
  // Two steps are kept free above the loop: sender and receiver, and the hiccup meter.
  spec.priority =
      static_cast<int>(table.integer_or("priority", spec.priority, engine::between(0.0, 97.0)));
  spec.core =
      static_cast<int>(table.integer_or("core", spec.core, engine::between(-1.0, CPU_SETSIZE - 1)));
  spec.lock_memory =
      table.choice_or<bool>("lock_memory", "when-allowed", {{"when-allowed", true}, {"no", false}});
  return spec;
}

bool raise_priority(int priority) noexcept {
  sched_param param{};
  param.sched_priority = priority;
  return sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) == 0;
}

RealtimeGrant enter_realtime(const RealtimeSpec& spec) {
  RealtimeGrant grant;
  std::string& text = grant.text;
  if (spec.priority > 0) {
    const bool given = raise_priority(spec.priority);
    text +=
        "priority " + std::to_string(spec.priority) + " " + (given ? "granted" : refusal(errno));
    if (given) grant.priority = spec.priority;
  } else {
    text += "priority not asked for";
  }
  if (spec.lock_memory) {
    // What no one has touched yet stays away: locking it would take seconds and gigabytes.
    grant.memory_locked = mlockall(MCL_CURRENT | MCL_ONFAULT) == 0;
    text += std::string(", memory ") + (grant.memory_locked ? "locked" : refusal(errno));
  }
  if (spec.core >= 0) {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    CPU_SET(static_cast<std::size_t>(spec.core), &cores);
    const bool given = sched_setaffinity(0, sizeof cores, &cores) == 0;
    text += ", core " + std::to_string(spec.core) + " " + (given ? "granted" : refusal(errno));
    if (given) grant.core = spec.core;
  }
  return grant;
}

void leave_realtime(const RealtimeGrant& grant) noexcept {
  const sched_param ordinary{};
  if (grant.priority > 0)
    static_cast<void>(sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary));
  if (grant.memory_locked) static_cast<void>(munlockall());
}

}  // namespace hil
