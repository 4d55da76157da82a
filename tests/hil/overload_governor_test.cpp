#include "hil/overload_governor.h"

#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "hil/decisions.h"
#include "hil/no_commands.h"
#include "tests/support/fakes.h"
#include "tests/support/small_loops.h"

namespace hil {
namespace {

using engine::Duration;
using engine::Shed;

constexpr Duration kPeriod{10'000'000};

/// What a frame takes by what it leaves out, in periods.
using Scene = std::array<double, engine::kSheds>;

/// The steps of so many frames of a scene.
std::vector<Shed> run(OverloadGovernor& governor, const Scene& scene, int frames) {
  std::vector<Shed> steps;
  for (int k = 0; k < frames; ++k) {
    steps.push_back(governor.shed());
    const double periods = scene.at(static_cast<std::size_t>(governor.shed()));
    governor.saw(engine::from_seconds(periods * engine::seconds(kPeriod)));
  }
  return steps;
}

TEST(OverloadGovernor, FramesThatFitAreWhole) {
  OverloadGovernor governor(kPeriod);
  for (const Shed shed : run(governor, {0.85, 0.5, 0.3, 0.2, 0.1}, 100))
    EXPECT_EQ(shed, Shed::kNothing);
}

TEST(OverloadGovernor, StepsComeInTheStatedOrder) {
  OverloadGovernor governor(kPeriod);
  const auto steps = run(governor, {3.0, 3.0, 3.0, 3.0, 3.0}, 7);
  const std::vector<Shed> expected = {Shed::kNothing, Shed::kUpkeep,  Shed::kSamples,
                                      Shed::kBounces, Shed::kShadows, Shed::kShadows,
                                      Shed::kShadows};
  EXPECT_EQ(steps, expected);
}

TEST(OverloadGovernor, ASceneNearTheLimitIsOverloadedEverMoreSeldom) {
  // The coarser frame leaves room for the finer one by the clock alone; by what the step brought it
  // does not. Trials come after 16, 32, 64 ... 1024 frames.
  OverloadGovernor governor(kPeriod);
  const auto steps = run(governor, {1.05, 0.5, 0.3, 0.2, 0.1}, 2100);
  const auto overloaded = std::ranges::count(steps, Shed::kNothing);
  EXPECT_EQ(overloaded, 8);
  EXPECT_EQ(std::ranges::count(steps, Shed::kUpkeep), 2100 - overloaded);
}

TEST(OverloadGovernor, FramesAreWholeAgainTwelveFramesAfterTheLoadIsGone) {
  OverloadGovernor governor(kPeriod);
  // A delay from outside: no step helps.
  EXPECT_EQ(run(governor, {3.0, 3.0, 3.0, 3.0, 3.0}, 50).back(), Shed::kShadows);
  const auto steps = run(governor, {0.6, 0.5, 0.4, 0.3, 0.2}, 14);
  EXPECT_EQ(steps.front(), Shed::kShadows);
  EXPECT_EQ(steps[4 * OverloadGovernor::kCalmFrames], Shed::kNothing);
  EXPECT_EQ(steps.back(), Shed::kNothing);
}

TEST(OverloadGovernor, OneSlowFrameCostsFewReducedOnes) {
  // By that frame's time the step has brought more than it does.
  OverloadGovernor governor(kPeriod);
  run(governor, {0.5, 0.3, 0.2, 0.1, 0.1}, 10);
  governor.saw(2 * kPeriod);
  const auto steps = run(governor, {0.5, 0.3, 0.2, 0.1, 0.1}, 100);
  EXPECT_EQ(std::ranges::count(steps, Shed::kUpkeep), OverloadGovernor::kLeastPatience);
  EXPECT_EQ(std::ranges::count(steps, Shed::kNothing), 100 - OverloadGovernor::kLeastPatience);
}

/// Takes what the scene says it does with what is left out, and remembers that.
class CostlyGenerator final : public engine::SceneGenerator {
 public:
  CostlyGenerator(ManualClock& clock, Scene heavy) : clock_(clock), scene_(heavy) {}

  engine::FrameReport expose(const engine::Shot& shot, engine::Budget budget, engine::DnImage& out,
                             engine::TruthMask& /*mask*/) noexcept override {
    steps.push_back(budget.shed);
    if (shot.sequence >= 20) scene_ = {0.3, 0.3, 0.3, 0.3, 0.3};
    std::ranges::fill(out.pixels(), static_cast<std::uint16_t>(budget.shed));
    clock_.pass(engine::from_seconds(scene_.at(static_cast<std::size_t>(budget.shed)) *
                                     engine::seconds(small_loops::kPeriod)));
    return {};
  }
  std::vector<Shed> steps;

 private:
  ManualClock& clock_;
  Scene scene_;
};

struct Flown {
  LoopReport report;
  std::vector<Shed> steps;
  std::vector<FrameRecord> records;
};
Flown fly(bool sheds, const Decisions* replay, Scene heavy) {
  ManualClock clock(small_loops::kStart - small_loops::kPeriod);
  fakes::IdealPointing pointing;
  CostlyGenerator generator(clock, heavy);
  fakes::Sink sink;
  NoCommands source;
  LoopSpec spec = small_loops::patient_loop(60);
  spec.sheds = sheds;
  spec.replay = replay;
  FrameLoop loop(spec, clock, pointing, generator, sink, source);
  const LoopReport report = loop.run({});
  return {report, generator.steps, small_loops::drain(loop.frames())};
}
constexpr Scene kTooMuch = {1.6, 1.4, 0.7, 0.5, 0.4};

TEST(OverloadGovernor, ALoopLeavesOutWhatDoesNotFitAndThenLosesNoFrame) {
  const Flown flown = fly(true, nullptr, kTooMuch);
  // The first two frames took 1.6 and 1.4 periods: each cost the one after it.
  EXPECT_EQ(flown.report.skipped, 2U);
  EXPECT_EQ(flown.report.by_shed[0] + flown.report.by_shed[1] + flown.report.by_shed[2], 58U);
  EXPECT_GE(flown.report.by_shed[2], 14U);
  EXPECT_EQ(flown.steps.back(), Shed::kNothing);
  for (const FrameRecord& r : flown.records)
    EXPECT_TRUE(r.sequence < 32 || r.shed == Shed::kNothing) << r.sequence;
}

TEST(OverloadGovernor, ALoopThatIsToLeaveNothingOutSkipsInstead) {
  const Flown flown = fly(false, nullptr, kTooMuch);
  EXPECT_EQ(flown.report.skipped, 10U);
  EXPECT_EQ(flown.report.by_shed[0], 50U);
}

TEST(OverloadGovernor, AReplayLeavesOutWhatTheRunLeftOut) {
  const Flown flown = fly(true, nullptr, kTooMuch);
  Decisions decisions;
  for (const FrameRecord& r : flown.records)
    decisions.due.push_back({r.sequence, r.handed_over, r.passes, r.shed});
  // On a machine that is never short of time.
  const Flown again = fly(true, &decisions, {0.1, 0.1, 0.1, 0.1, 0.1});
  EXPECT_EQ(again.steps, flown.steps);
}

}  // namespace
}  // namespace hil
