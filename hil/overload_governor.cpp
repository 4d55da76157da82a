#include "hil/overload_governor.h"

#include <algorithm>

namespace hil {

void OverloadGovernor::saw(engine::Duration busy) noexcept {
  const double busy_s = engine::seconds(busy);
  if (before_s_ > 0.0) {
    share_[step_] = std::min(busy_s / before_s_, 1.0);
    before_s_ = 0.0;
  }
  if (busy_s > kMost * period_s_) {
    if (tried_ && fitting_ < kCalmFrames) patience_ = std::min(2 * patience_, kMostPatience);
    calm_ = fitting_ = 0;
    tried_ = false;
    if (step_ == kLast) return;
    ++step_;
    before_s_ = busy_s;
    return;
  }
  ++fitting_;
  if (tried_ && fitting_ == kCalmFrames) patience_ = kLeastPatience;
  if (step_ == 0) return;
  calm_ = busy_s < kSpare * period_s_ * share_[step_] ? calm_ + 1 : 0;
  if (calm_ < kCalmFrames && fitting_ < patience_) return;
  tried_ = calm_ < kCalmFrames;
  calm_ = fitting_ = 0;
  --step_;
}

}  // namespace hil
