#pragma once

#include <array>

#include "engine/core/time.h"
#include "engine/render/renderer.h"

namespace hil {

/// How much a frame leaves out so that frames come in time: a step more after a frame that took
/// longer than its period has, a step less when the finer one is expected to fit with some to
/// spare, three frames in a row. What a step brings is measured when it is taken, so that a scene
/// near the limit stays at a step instead of going to and fro. What was measured by chance, a frame
/// that the machine held up, does not stay: after 16 frames that fit the finer step is tried, and
/// each time in vain after twice as many.
/// Thread: loop. Loop-safe.
class OverloadGovernor {
 public:
  /// Of a period, what a frame may take, and what is expected of the finer one.
  static constexpr double kMost = 0.9;
  static constexpr double kSpare = 0.75;
  static constexpr int kCalmFrames = 3;
  static constexpr int kLeastPatience = 16;
  static constexpr int kMostPatience = 1024;

  explicit OverloadGovernor(engine::Duration period) noexcept
      : period_s_(engine::seconds(period)) {}

  /// For the next frame.
  [[nodiscard]] engine::Shed shed() const noexcept { return static_cast<engine::Shed>(step_); }
  /// What the last one took, from the wake-up at its shutter's opening to its hand-over.
  void saw(engine::Duration busy) noexcept;

 private:
  static constexpr std::size_t kLast = engine::kSheds - 1;
  double period_s_;
  std::size_t step_ = 0;
  int calm_ = 0;                   ///< frames that leave room for the finer step
  int fitting_ = 0;                ///< frames since the last change
  int patience_ = kLeastPatience;  ///< so many of these, and the finer step is tried
  bool tried_ = false;             ///< the last change was such a trial
  /// Of the frame that a step more came after; 0: it is known what that brings.
  double before_s_ = 0;
  /// Time of a frame at a step over that at the step before.
  std::array<double, engine::kSheds> share_{1, 1, 1, 1, 1};
};

}  // namespace hil
