#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "drivers/shm_link.h"
#include "tests/support/process.h"

/// The examples hold a target: each in its own process, on a camera that trims at once.
namespace {

using engine::Duration;
using engine::SimTime;
using process::Process;

constexpr int kSide_px = 128;
constexpr double kIfov_rad = 2e-6;
constexpr Duration kPeriod{100'000'000};
constexpr Duration kLong{60'000'000'000};  // only an example that is wrong waits this long

/// A camera whose target drifts away from the guidance's line, in lockstep with its software.
class Rig {
 public:
  Rig()
      : name_("starloop-test-" + std::to_string(getpid()) + "-" +
              testing::UnitTest::GetInstance()->current_test_info()->name()),
        link_({.name = name_, .when_full = drivers::WhenFull::kWait}, kSide_px, kSide_px) {}

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// Before the Earth a target may be a hole in the light.
  void brighten_sky() noexcept {
    sky_dn_ = 300.0;
    sky_noise_dn_ = 4.0;
    target_dn_ = -280.0;
  }

  /// How far from the middle the target was seen, frame by frame, px.
  std::vector<double> run(std::uint64_t frames, bool with_target) {
    std::vector<double> error_px;
    for (std::uint64_t k = 0; k < frames; ++k) {
      const SimTime open = engine::sim_time(1000.0) + kPeriod * static_cast<std::int64_t>(k);
      const double t = 0.1 * static_cast<double>(k);
      const hil::TrimAngles trim = trim_at(open + kExposure / 2);
      // 20 px off at first, and 3 px a frame further: soon out of the field unless it is followed.
      const std::array<double, 2> seen_px{20.0 + 30.0 * t - trim[0] / kIfov_rad,
                                          -15.0 - 20.0 * t - trim[1] / kIfov_rad};
      draw(seen_px, with_target);
      error_px.push_back(std::hypot(seen_px[0], seen_px[1]));
      hil::Frame frame;
      frame.sequence = k;
      frame.shutter_open = open;
      frame.exposure = kExposure;
      frame.trim_rad = trim;
      frame.pixels = &pixels_;
      if (!link_.send(frame, kLong).ok()) break;
      const auto command = link_.receive(kLong);
      if (!command.ok() || command.value().answers_frame != k) break;
      last_ = command.value();
    }
    return error_px;
  }
  [[nodiscard]] const hil::Command& last_command() const noexcept { return last_; }

 private:
  static constexpr Duration kExposure{1'000'000};

  [[nodiscard]] hil::TrimAngles trim_at(SimTime t) const noexcept {
    const double dt = engine::seconds(t - last_.reference);
    if (last_.kind != hil::CommandKind::kTrim) return {};
    return {last_.trim_offset_rad[0] + last_.trim_rate_rad_s[0] * dt,
            last_.trim_offset_rad[1] + last_.trim_rate_rad_s[1] * dt};
  }

  void draw(const std::array<double, 2>& from_middle_px, bool with_target) {
    std::normal_distribution<double> noise(sky_dn_, sky_noise_dn_);
    for (int v = 0; v < kSide_px; ++v) {
      for (int u = 0; u < kSide_px; ++u) {
        const double du = u - kSide_px / 2 - from_middle_px[0];
        const double dv = v - kSide_px / 2 - from_middle_px[1];
        const double target =
            with_target ? target_dn_ * std::exp(-(du * du + dv * dv) / 18.0) : 0.0;
        pixels_.at(u, v) =
            static_cast<std::uint16_t>(std::lround(std::max(0.0, noise(random_) + target)));
      }
    }
  }

  std::string name_;
  drivers::ShmLink link_;
  engine::DnImage pixels_{kSide_px, kSide_px};
  hil::Command last_;
  double sky_dn_ = 20.0;
  double sky_noise_dn_ = 1.0;
  double target_dn_ = 900.0;
  std::mt19937 random_{1};
};

std::vector<std::string> environment() {
  return {"PYTHONPATH=" STARLOOP_SOURCE_DIR "/drivers/client/python",
          "STARLOOP_CLIENT_LIBRARY=" STARLOOP_CLIENT_LIBRARY, "PYTHONDONTWRITEBYTECODE=1"};
}

void expect_holds_the_target(std::vector<std::string> words, bool before_the_earth = false) {
  constexpr std::uint64_t kFrames = 40;
  auto rig = std::make_unique<Rig>();
  if (before_the_earth) rig->brighten_sky();
  words.push_back(rig->name());
  words.push_back(std::to_string(kIfov_rad * 1e6) + "e-6");
  Process example(words, environment());
  const std::vector<double> error_px = rig->run(kFrames, true);
  ASSERT_EQ(error_px.size(), kFrames);
  EXPECT_GT(error_px.front(), 20.0);
  // Before the Earth 16 000 DN under 4 DN of noise: 0.06 px, after the filter's rate 0.08.
  // The spot's 50 000 DN under 1 DN of noise over some 500 px: its centroid is good to 0.005 px,
  // and the rate that an alpha-beta filter makes of it to the same over a frame. 0.2 px is far
  // over both and a fifteenth of what the target moves in a frame.
  for (std::size_t k = kFrames / 2; k < kFrames; ++k) EXPECT_LT(error_px[k], 0.2) << k;
  EXPECT_EQ(rig->last_command().detection.confidence, 1.0F);
  EXPECT_NEAR(rig->last_command().detection.centroid_px.u, kSide_px / 2, 0.3);
  rig.reset();
  EXPECT_EQ(example.wait(), 0) << "it should end when the camera has gone";
}

void expect_reports_an_empty_sky(std::vector<std::string> words) {
  auto rig = std::make_unique<Rig>();
  words.push_back(rig->name());
  Process example(words, environment());
  EXPECT_EQ(rig->run(5, false).size(), 5U);
  EXPECT_EQ(rig->last_command().answers_frame, 4U);
  EXPECT_EQ(rig->last_command().kind, hil::CommandKind::kReport);
  EXPECT_EQ(rig->last_command().detection.confidence, 0.0F);
  rig.reset();
  EXPECT_EQ(example.wait(), 0);
}

TEST(Examples, TheOneInCHoldsTheTarget) { expect_holds_the_target({STARLOOP_EXAMPLE_C}); }
TEST(Examples, TheOneInCHoldsADarkTargetBeforeTheEarth) {
  expect_holds_the_target({STARLOOP_EXAMPLE_C}, true);
}
TEST(Examples, TheOneWithOpenCvHoldsADarkTargetBeforeTheEarth) {
  expect_holds_the_target({STARLOOP_EXAMPLE_OPENCV}, true);
}
TEST(Examples, TheOneInCReportsAnEmptySky) { expect_reports_an_empty_sky({STARLOOP_EXAMPLE_C}); }
TEST(Examples, TheOneWithOpenCvHoldsTheTarget) {
  expect_holds_the_target({STARLOOP_EXAMPLE_OPENCV});
}
TEST(Examples, TheOneWithOpenCvReportsAnEmptySky) {
  expect_reports_an_empty_sky({STARLOOP_EXAMPLE_OPENCV});
}
#ifdef STARLOOP_PYTHON
TEST(Examples, TheOneInPythonHoldsTheTarget) {
  expect_holds_the_target({STARLOOP_PYTHON, STARLOOP_SOURCE_DIR "/tools/examples/tracker.py"});
}
TEST(Examples, TheOneInPythonHoldsADarkTargetBeforeTheEarth) {
  expect_holds_the_target({STARLOOP_PYTHON, STARLOOP_SOURCE_DIR "/tools/examples/tracker.py"},
                          true);
}
TEST(Examples, TheOneInPythonReportsAnEmptySky) {
  expect_reports_an_empty_sky({STARLOOP_PYTHON, STARLOOP_SOURCE_DIR "/tools/examples/tracker.py"});
}
#endif

}  // namespace
