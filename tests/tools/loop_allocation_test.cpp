// The loop with everything real in it but the cable and the software under test: once the first
// shutter has opened, nobody takes anything from the heap.

#include <array>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "drivers/mock_link.h"
#include "tests/support/no_alloc.h"
#include "tools/quality/image_quality.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/scenario.h"

namespace {

using engine::Duration;

/// The paper's pass through a camera of 128 x 128 coarse pixels, the whole telescope in view.
/// "sensor": with all that a detector can have. "far": a wide field, in which it is five pixels
/// across and drawn from its light as a whole.
starloop::Scenario small_scenario(const std::string& what) {
  const bool companions = what == "companions";
  const bool far = what == "far";
  const bool sensor = what == "sensor";
  const std::string method = companions || far || sensor ? "paths" : what;
  starloop::CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/flyby.toml";
  options.overrides = {"camera.width_px=128",
                       "camera.height_px=128",
                       "camera.pixel_pitch_um=13",
                       far ? "optics.aperture_m=0.015" : "optics.aperture_m=0.18",
                       far ? "camera.focal_length_m=0.3" : "camera.focal_length_m=4.5",
                       "render.samples_per_pixel=4",
                       "render.method=" + method.substr(0, method.find('_')),
                       "optics.largest_wing_px=16",
                       "guidance.error_x_urad=5",
                       "guidance.error_growth_x_urad_s=1",
                       "guidance.target_error_along_m=1",
                       "actuator.delay_ms=9",
                       "earth.earthshine=auto",
                       "earth.in_frame=auto",
                       "jitter.lines.wheel.frequency_hz=40",
                       "jitter.lines.wheel.amplitude_urad=1",
                       "sensors.star_tracker_across_arcsec=1",
                       "sensors.gyro_noise_deg_rt_h=0.01",
                       "stars.catalogue=built-in"};
  if (companions) {
    options.overrides.insert(options.overrides.end(),
                             {"companions.a.along_m=12", "companions.b.cross_m=-15"});
  }
  if (sensor) {
    options.overrides.insert(
        options.overrides.end(),
        {"detector.prnu_rms=0.01", "detector.dsnu_rms=0.3", "detector.hot_pixels=0.001",
         "detector.dead_columns=1", "detector.hot_columns=1", "detector.blooming=column",
         "detector.full_well_e=500", "detector.cosmic_rays_cm2_s=1e5"});
  }
  return starloop::load_scenario(options);
}

struct Outcome {
  hil::LoopReport report;
  std::uint64_t allocations = 0;
  std::uint64_t frames_with_target = 0;
  std::uint64_t records = 0;
};

class Bench {
 public:
  explicit Bench(const std::string& method)
      : scenario_(small_scenario(method)),
        rig_(scenario_, 2),
        deadline_(method.ends_with("_deadline") ? Duration(1'000'000) : Duration{}) {
    pass_ = starloop::passes_of(scenario_)[scenario_.run.pass - 1];
  }

  /// Lockstep, 250 frames a second: 500 of them are the two seconds about the nearest point.
  Outcome run(std::uint64_t frames) {
    hil::LoopSpec spec;
    spec.start = pass_.closest - Duration(1'000'000'000);
    spec.period = Duration(4'000'000);
    spec.exposure = Duration(1'000'000);
    spec.command_lead = Duration(1'000'000);
    spec.frames = frames;
    spec.when_busy = hil::WhenBusy::kWait;
    spec.answer_timeout = std::chrono::seconds(20);
    spec.send_timeout = std::chrono::seconds(20);
    spec.width_px = scenario_.scene.camera.width_px;
    spec.height_px = scenario_.scene.camera.height_px;
    spec.bits = scenario_.detector.bits;
    spec.render_time = deadline_;
    drivers::MockLink link(spec.width_px, spec.height_px);
    hil::ClosedLoopPointing pointing = starloop::make_pointing(scenario_, rig_, spec.start);
    hil::ManualClock clock(spec.start - spec.period);
    auto loop =
        std::make_unique<hil::FrameLoop>(spec, clock, pointing, rig_.generator(), link, link);

    Outcome out;
    std::jthread device([&link](const std::stop_token& stop) { answer_frames(link, stop); });
    std::jthread observer([&](const std::stop_token& stop) {
      // The last look comes after the stop.
      for (bool last = false;; last = stop.stop_requested()) {
        for (hil::FrameRecord r; loop->frames().pop(r); ++out.records)
          if (r.report.truth.peak_e > 100.0) ++out.frames_with_target;
        for (hil::CommandRecord c; loop->commands().pop(c);) {
        }
        if (last) return;
        std::this_thread::yield();
      }
    });
    const std::uint64_t before = no_alloc::count();
    out.report = loop->run({});
    out.allocations = no_alloc::count() - before;
    return out;
  }

 private:
  /// Software under test that only replies: what its own work allocates is not the loop's business.
  static void answer_frames(drivers::MockLink& link, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto bytes = link.next_frame(Duration(20'000'000));
      if (!bytes.ok()) continue;
      const auto view = drivers::decode_frame(bytes.value());
      ENSURE(view.ok());
      // Trims, rates and changes of line, all of which leave the target in the frame.
      constexpr std::array kKinds{hil::CommandKind::kTrim, hil::CommandKind::kRate,
                                  hil::CommandKind::kMode};
      hil::Command command;
      command.kind = kKinds[view.value().frame.sequence % kKinds.size()];
      command.answers_frame = view.value().frame.sequence;
      command.sequence = command.answers_frame + 1;
      command.trim_offset_rad = {-5e-6, 0.0};
      command.reference = view.value().frame.shutter_open;
      const hil::CommandPacket packet = hil::encode_command(command);
      link.release_frame();
      ENSURE(link.reply(packet.bytes()).ok());
    }
  }

  starloop::Scenario scenario_;
  starloop::Rig rig_;
  Duration deadline_;
  engine::Pass pass_;
};

TEST(AllocationCounter, CountsEveryWayToTheHeap) {
  if (!no_alloc::armed()) GTEST_SKIP() << "a sanitizer counts instead";
  const auto counted = [](auto&& allocate) {
    const std::uint64_t before = no_alloc::count();
    allocate();
    return no_alloc::count() - before;
  };
  // volatile: the compiler may leave out an allocation that nobody looks at.
  EXPECT_EQ(counted([] {}), 0U);
  EXPECT_EQ(counted([] {
              char* volatile block = new char[100];
              delete[] block;
            }),
            1U);
  EXPECT_EQ(counted([] {
              void* volatile block = std::malloc(100);
              block = std::realloc(block, 200);
              std::free(block);
            }),
            2U);
  EXPECT_EQ(counted([] {
              void* volatile block = std::aligned_alloc(64, 128);
              std::free(block);
            }),
            1U);
  // And on other threads.
  std::uint64_t before = 0;
  std::uint64_t after = 0;
  std::jthread([&] {
    before = no_alloc::count();
    std::vector<int> v(1000);
    *const_cast<volatile int*>(v.data()) = 1;
    after = no_alloc::count();
  }).join();
  EXPECT_EQ(after - before, 1U);
}

TEST(ImageQuality, NoFrameTakesAnythingFromTheHeap) {
  if (!no_alloc::armed()) GTEST_SKIP() << "a sanitizer counts instead";
  quality::Meter meter(256, 256);
  engine::DnImage frame(256, 256);
  const std::uint64_t before = no_alloc::count();
  int scored = 0;
  for (int i = 0; i < 50; ++i) {
    // From a square on black to noise with more runs than there is room for.
    for (int v = 0; v < 256; ++v)
      for (int u = 0; u < 256; ++u)
        frame.at(u, v) =
            static_cast<std::uint16_t>((u > 90 && u < 160 && v > 90 && v < 160 ? 500 : 20) +
                                       (u * 37 + v * 101) % (1 + 40 * i));
    if (meter.measure(frame, {2047, 14.65}).score_db) ++scored;
  }
  EXPECT_EQ(no_alloc::count(), before);
  EXPECT_GT(scored, 5);
}

class LoopAllocation : public testing::TestWithParam<const char*> {};

TEST_P(LoopAllocation, FiveHundredFramesTakeNoMoreFromTheHeapThanTen) {
  if (!no_alloc::armed()) GTEST_SKIP() << "a sanitizer counts instead";
  Bench bench(GetParam());
  const Outcome warm_up = bench.run(10);
  ASSERT_EQ(warm_up.report.sent, 10U);
  const Outcome few = bench.run(10);
  const Outcome many = bench.run(500);
  for (const auto& [outcome, frames] : {std::pair(&few, 10U), {&many, 500U}}) {
    // A loop that drops its frames, or shows an empty sky, would prove nothing.
    EXPECT_EQ(outcome->report.due, frames);
    EXPECT_EQ(outcome->report.sent, frames);
    EXPECT_EQ(outcome->report.commands, frames);
    EXPECT_EQ(outcome->records, frames);
    EXPECT_EQ(outcome->frames_with_target, frames);
    EXPECT_FALSE(outcome->report.answer_missing);
  }
  EXPECT_EQ(few.allocations, many.allocations);
}

INSTANTIATE_TEST_SUITE_P(Methods, LoopAllocation,
                         testing::Values("paths", "paths_deadline", "lattice", "companions", "far",
                                         "sensor"));

}  // namespace
