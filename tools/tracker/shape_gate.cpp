#include "tools/tracker/shape_gate.h"

#include <algorithm>
#include <cmath>

namespace tracker {
namespace {

// An alpha-beta filter on the area: slow, for the area is noisy and grows by a few per cent a frame
// at most.
constexpr double kAlpha = 0.4;
constexpr double kBeta = 0.1;

}  // namespace

bool ShapeGate::believes(double area_px, double surprise_px, engine::SimTime when) noexcept {
  const double log_area = std::log(area_px);
  const double dt_s = engine::seconds(when - believed_);
  if (learnt_ == 0 || !(dt_s > 0.0) || dt_s > kPatience_s) {
    learnt_ = 1;
    log_area_ = log_area;
    rate_1_s_ = 0.0;
    believed_ = when;
    return true;
  }
  const double predicted = log_area_ + rate_1_s_ * dt_s;
  const double jump = log_area - predicted;
  const double wider = 1.0 + dt_s / kPatience_s;
  const double expected_px = std::max(1.0, kSurprise * std::sqrt(area_px));
  if (learnt_ >= kToLearn && std::abs(jump) > kJump * wider && surprise_px > expected_px * wider)
    return false;
  learnt_ = std::min(learnt_ + 1, kToLearn);
  log_area_ = predicted + kAlpha * jump;
  rate_1_s_ += kBeta * jump / dt_s;
  believed_ = when;
  return true;
}

}  // namespace tracker
