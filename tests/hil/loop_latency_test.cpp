// The loop's latency, measured by what it does to a feedback loop around it.

#include <cmath>
#include <deque>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "hil/closed_loop_pointing.h"
#include "hil/frame_loop.h"
#include "tests/support/bodies.h"
#include "tests/support/fakes.h"

namespace {

using hil::Command;
using hil::CommandKind;
using hil::Frame;

/// What is left of a pointing error of 1 after `frames` frames of lockstep, when the software under
/// test takes `gain` of the error it sees off its trim, and answers `late` frames late, and a trim
/// of 1 turns `pointing` by `unit_rad`. The actuator is ideal, so x[k + 1] = x[k] - gain * x[k -
/// late - d], and d is the delay of loop and pointing.
double error_left(hil::PointingSource& pointing, engine::SceneGenerator& generator, double unit_rad,
                  double gain, std::size_t late, std::uint64_t frames) {
  hil::LoopSpec spec;
  spec.frames = frames;
  spec.width_px = 5;
  spec.height_px = 1;
  spec.when_busy = hil::WhenBusy::kWait;
  spec.answer_timeout = std::chrono::seconds(20);
  hil::ManualClock clock(spec.start - spec.period);
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
    command.trim_offset_rad = {unit_rad * trim, 0.0};
    return command;
  });
  hil::FrameLoop loop(spec, clock, pointing, generator, device, device);
  const hil::LoopReport report = loop.run({});
  EXPECT_EQ(report.sent, frames);
  EXPECT_FALSE(report.answer_missing);
  return largest;
}

double error_left(double gain, std::size_t late, std::uint64_t frames) {
  fakes::IdealPointing pointing(1.0);
  fakes::PixelGenerator generator;
  return error_left(pointing, generator, 1.0, gain, late, frames);
}

// A nanoradian, so that what grows ten thousand times is still a small angle.
constexpr double kUnit_rad = 1e-9;

/// Sees by how many units the boresight is off the target, at mid-exposure.
class BoresightGenerator final : public engine::SceneGenerator {
 public:
  explicit BoresightGenerator(const Eigen::Vector3d& to_target) : to_target_(to_target) {}
  engine::FrameReport expose(const engine::Shot& shot, engine::Budget budget, engine::DnImage& out,
                             engine::TruthMask& mask) noexcept override {
    const Eigen::Vector3d seen = shot.attitude.middle.axes.matrix * to_target_;
    engine::Shot told = shot;
    told.attitude.middle.axes.matrix(0, 0) = -std::atan2(seen.x(), seen.z()) / kUnit_rad;
    return pixels_.expose(told, budget, out, mask);
  }

 private:
  Eigen::Vector3d to_target_;
  fakes::PixelGenerator pixels_;
};

/// The same with the real pointing: a guidance error of one unit, and an ideal actuator that takes
/// commands `delay` frames late.
double error_left_by_the_camera(double gain, int delay, std::uint64_t frames) {
  const Eigen::Vector3d camera_m(7e6, 1e5, -2e5);
  const Eigen::Vector3d line_m(4e4, -9e4, 3e4);
  const test_support::FixedBody camera(camera_m);
  const test_support::FixedBody target(camera_m + line_m);
  hil::PointingSpec spec;
  spec.error.offset_rad = {kUnit_rad, 0.0};
  spec.actuator.ideal = true;
  spec.actuator.delay = delay * hil::LoopSpec{}.period;
  hil::ClosedLoopPointing pointing(
      hil::ScriptedPointing(camera, target, engine::Epoch{}, engine::LightPath::kGeometric,
                            hil::RollRule::kCelestial),
      spec);
  BoresightGenerator generator(line_m);
  return error_left(pointing, generator, kUnit_rad, gain, 0, frames);
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

TEST(LoopLatency, OfTheCameraThatObeysIsTheLoopsOwnFrameAndTheActuatorsDelay) {
  // Critical gains 2, 1, 0.618, 0.445 for delays of 0 to 3 periods; as above, but rounding of
  // angles to 1e-16 is 1e-7 units.
  for (int d = 0; d <= 3; ++d) {
    SCOPED_TRACE(d);
    const double g = critical_gain(d);
    EXPECT_LT(error_left_by_the_camera(0.95 * g, d, 600), 0.1);
    EXPECT_GT(error_left_by_the_camera(1.05 * g, d, d == 0 ? 150 : 600), 10.0);
  }
}

}  // namespace
