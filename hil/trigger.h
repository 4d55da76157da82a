#pragma once

#include <algorithm>
#include <semaphore>
#include <stop_token>

#include "engine/core/time.h"

namespace hil {

/// Somebody outside says when a shutter opens: a packet, a line on a pipe. Each pull is one frame;
/// pulls that come while a frame is made wait for their turn.
/// Thread: any for pull(), loop for wait().
class Trigger {
 public:
  void pull() noexcept { pulls_.release(); }
  /// False: nobody pulled within `timeout`, or the loop is to stop.
  [[nodiscard]] bool wait(engine::Duration timeout, const std::stop_token& stop) noexcept {
    constexpr engine::Duration kPatience{50'000'000};  // how often it looks for the stop
    for (engine::Duration left = timeout; left > engine::Duration{}; left -= kPatience) {
      if (stop.stop_requested()) return false;
      if (pulls_.try_acquire_for(std::min(left, kPatience))) return true;
    }
    return false;
  }

 private:
  std::counting_semaphore<> pulls_{0};
};

}  // namespace hil
