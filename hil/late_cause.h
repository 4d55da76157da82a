#pragma once

#include <cstdint>
#include <optional>

#include "engine/core/time.h"

namespace hil {

/// Whose doing it is that a shutter opens late.
enum class LateCause : std::uint8_t {
  kNone,
  kOwnWork,  ///< the frame before was not done, or threads of ours had the loop's processor
  kMachine,  ///< the system did not run a thread that wanted to run
  kUnknown,  ///< the loop was done in time and woke late, and the system keeps no account of why
};
inline constexpr int kLateCauses = 4;

/// Where a thread's time went; what is left of it, the thread slept.
struct RunTime {
  engine::Duration ran{};          ///< on a processor
  engine::Duration queued{};       ///< it wanted a processor, and something else had it
  engine::Duration process_ran{};  ///< all threads of the process, on all processors

  friend RunTime operator-(const RunTime& a, const RunTime& b) noexcept {
    return {a.ran - b.ran, a.queued - b.queued, a.process_ran - b.process_ran};
  }
};

/// What is known of a delay.
struct Delay {
  engine::Duration late{};
  bool in_time = false;        ///< the loop had nothing left to do before the shutter opened
  engine::Duration held_up{};  ///< of it, the hiccup meter did not run either
  /// Of the loop's thread, from when it had nothing left to do until the shutter opened.
  std::optional<RunTime> loop;
};

/// The machine's is what held up the meter for most of the delay, and a timer that came late: the
/// loop slept on, or was queued behind other programs. Where ours and theirs cannot be told apart,
/// it is ours.
[[nodiscard]] LateCause late_cause(const Delay& delay) noexcept;

/// The scheduler's account of one thread, since it began (/proc/thread-self/schedstat).
/// Thread: the one that made it. Allocates nothing.
class RunTimeMeter {
 public:
  RunTimeMeter() noexcept;
  ~RunTimeMeter();
  RunTimeMeter(const RunTimeMeter&) = delete;
  RunTimeMeter& operator=(const RunTimeMeter&) = delete;

  /// Nothing where the kernel keeps no such account.
  [[nodiscard]] std::optional<RunTime> read() const noexcept;

 private:
  int file_ = -1;
};

}  // namespace hil
