// The loop's latency, measured by what it does to a feedback loop around it.

#include <cmath>
#include <deque>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "hil/frame_loop.h"
#include "tests/support/fakes.h"

namespace {

using hil::Command;
using hil::CommandKind;
using hil::Frame;

/// What is left of a pointing error of 1 after `frames` frames of lockstep, when the software under
/// test takes `gain` of the error it sees off its trim, and answers `late` frames late. The
/// actuator is ideal, so x[k + 1] = x[k] - gain * x[k - late - d], and d is the loop's own delay.
double error_left(double gain, std::size_t late, std::uint64_t frames) {
  hil::LoopSpec spec;
  spec.frames = frames;
  spec.width_px = 5;
  spec.height_px = 1;
  spec.when_busy = hil::WhenBusy::kWait;
  spec.answer_timeout = std::chrono::seconds(20);
  hil::ManualClock clock(spec.start - spec.period);
  fakes::IdealPointing pointing(1.0);
  fakes::PixelGenerator generator;
  double trim = 0;
  std::deque<double> seen(late, 0.0);
  double largest = 0;
  fakes::Device device([&](const Frame& frame) {
    const double error = fakes::seen_in(frame);
    seen.push_back(error);
    trim -= gain * seen.front();
    seen.pop_front();
    // The last periods of an oscillation: a single frame could be at a zero crossing.
    if (frame.sequence + 20 >= frames) largest = std::max(largest, std::abs(error));
    Command command;
    command.answers_frame = frame.sequence;
    command.kind = CommandKind::kTrim;
    command.trim_offset_rad = {trim, 0.0};
    return command;
  });
  hil::FrameLoop loop(spec, clock, pointing, generator, device, device);
  const hil::LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, frames);
  EXPECT_FALSE(report.answer_missing);
  return largest;
}

// x[k + 1] = x[k] - g x[k - d] is stable for 0 < g < 2 sin(pi / (2 (2 d + 1))).
double critical_gain(int d) { return 2.0 * std::sin(engine::kPi / (2.0 * (2.0 * d + 1.0))); }

TEST(LoopLatency, IsOneFrameSoAGainOfUpToTwoIsStable) {
  // A command that answers frame k shows in frame k + 1, so d = 0 and x[k] = (1 - g)^k: 0.9^80 and
  // 1.1^80 of the last twenty frames of a hundred.
  EXPECT_NEAR(error_left(1.0, 0, 100), 0.0, 1e-12);
  EXPECT_LT(error_left(1.9, 0, 100), 2.2e-4);
  EXPECT_GT(error_left(2.1, 0, 100), 2000.0);
}

TEST(LoopLatency, EveryFrameMoreLowersTheCriticalGainAsThePeriodsSay) {
  // Shows that the measurement tells one frame from two: 5 % below and above the critical gain.
  // The roots of z^(d+1) - z^d + g nearest to the unit circle make that 0.9896
  // and 1.0101 a frame for d = 3, further from 1 for less; 600 frames leave 2e-3 and 400.
  for (int d = 0; d <= 3; ++d) {
    SCOPED_TRACE(d);
    const double g = critical_gain(d);
    EXPECT_LT(error_left(0.95 * g, static_cast<std::size_t>(d), 600), 0.1);
    EXPECT_GT(error_left(1.05 * g, static_cast<std::size_t>(d), 600), 10.0);
  }
}

}  // namespace
