#include "hil/realtime.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using hil::RealtimeGrant;
using hil::RealtimeSpec;

/// In a process of its own: what it asks the system for, the other tests do not get.
template <class Check>
int in_a_child(Check check) {
  const pid_t child = fork();
  if (child == 0) std::_Exit(check());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Realtime, WhatItSaysWasGrantedIsWhatTheSystemKeeps) {
  EXPECT_EQ(in_a_child([] {
              const RealtimeGrant grant = hil::enter_realtime({.priority = 7, .core = 0});
              sched_param param{};
              sched_getparam(0, &param);
              const bool is_fifo = (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_FIFO;
              if (is_fifo != (grant.priority == 7)) return 1;
              if (is_fifo && param.sched_priority != 7) return 2;
              cpu_set_t cores;
              sched_getaffinity(0, sizeof cores, &cores);
              if (grant.core == 0 && (CPU_COUNT(&cores) != 1 || !CPU_ISSET(0, &cores))) return 3;
              hil::leave_realtime(grant);
              if ((sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) != SCHED_OTHER) return 4;
              return 0;
            }),
            0);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// A sanitizer answers mlockall() itself, with success, and locks nothing.
constexpr bool kLocksForReal = false;
#else
constexpr bool kLocksForReal = true;
#endif

TEST(Realtime, ARefusalIsSaidAndIsNoError) {
  EXPECT_EQ(in_a_child([] {
              // Nobody may lock memory or have a priority, root neither once it is another user.
              const rlimit none{0, 0};
              setrlimit(RLIMIT_MEMLOCK, &none);
              setrlimit(RLIMIT_RTPRIO, &none);
              if (getuid() == 0 && setuid(65534) != 0) return 1;
              const RealtimeGrant grant = hil::enter_realtime({.priority = 7, .core = 1023});
              if (grant.priority != 0 || grant.core != -1) return 2;
              if (grant.memory_locked && kLocksForReal) return 4;
              for (const char* part :
                   {"priority 7 refused (", "memory refused (", "core 1023 refused ("}) {
                const bool said = grant.text.find(part) != std::string::npos;
                if (!said && (kLocksForReal || part[0] != 'm')) return 3;
              }
              return 0;
            }),
            0);
}

TEST(Realtime, WhatWasNotAskedForIsLeftAlone) {
  EXPECT_EQ(in_a_child([] {
              const RealtimeGrant grant =
                  hil::enter_realtime({.priority = 0, .core = -1, .lock_memory = false});
              return sched_getscheduler(0) == SCHED_OTHER && grant.text == "priority not asked for"
                         ? 0
                         : 1;
            }),
            0);
}

TEST(Realtime, ChildrenDoNotInheritThePriority) {
  EXPECT_EQ(in_a_child([] {
              if (!hil::raise_priority(5)) return 0;  // not allowed here: nothing to inherit
              return in_a_child([] { return sched_getscheduler(0) == SCHED_OTHER ? 0 : 1; });
            }),
            0);
}

TEST(Realtime, ReadsItsTableAndRefusesWhatNoSystemHas) {
  const auto read = [](const char* text) {
    const auto config = engine::ConfigReader::from_text(text, "x.toml");
    const RealtimeSpec spec = hil::read_realtime(config.table("realtime"));
    config.reject_unknown_keys();
    return spec;
  };
  EXPECT_EQ(read("").priority, 10);
  EXPECT_TRUE(read("").lock_memory);
  const RealtimeSpec spec = read("[realtime]\npriority = 40\ncore = 1\nlock_memory = \"no\"\n");
  EXPECT_EQ(spec.priority, 40);
  EXPECT_EQ(spec.core, 1);
  EXPECT_FALSE(spec.lock_memory);
  EXPECT_THROW(read("[realtime]\npriority = 98\n"), engine::ConfigError);
  EXPECT_THROW(read("[realtime]\ncore = -2\n"), engine::ConfigError);
}

}  // namespace
