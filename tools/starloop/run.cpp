#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <stop_token>

#include <spdlog/spdlog.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "drivers/mock_link.h"
#include "engine/core/constants.h"
#include "engine/orbit/utc.h"
#include "hil/steady_clock.h"
#include "tools/starloop/run_folder.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Duration;
using engine::seconds;

constexpr Duration kPatience{20'000'000};
// Set-up to first shutter: time for the threads to stand ready.
constexpr Duration kRunUp{300'000'000};

volatile std::sig_atomic_t interrupted = 0;
void on_signal(int /*signal*/) { interrupted = 1; }

/// The software under test: on a thread of its own, it sees bytes and answers with bytes.
void run_tracker(drivers::MockLink& link, tracker::Tracker& tracker, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto bytes = link.next_frame(kPatience);
    if (!bytes.ok()) continue;
    const auto answer = tracker.on_frame(bytes.value());
    link.release_frame();
    if (answer) static_cast<void>(link.reply(answer->bytes()));
  }
}

/// Takes the loop's records, keeps them, and shows where it is.
class Observer {
 public:
  Observer(const Scenario& scenario, hil::FrameLoop& loop, std::uint64_t frames, bool quiet)
      : scenario_(scenario), loop_(loop), due_(frames), quiet_(quiet) {
    log_.frames.reserve(frames);
    log_.commands.reserve(frames * 2);
    terminal_ = isatty(fileno(stdout)) != 0;
  }

  void watch(const std::stop_token& stop, std::stop_source& loop_stop) {
    while (!stop.stop_requested()) {
      take();
      if (interrupted != 0) loop_stop.request_stop();
      std::this_thread::sleep_for(kPatience);
    }
    take();
    if (!quiet_ && terminal_) std::printf("\n");
  }
  [[nodiscard]] RunLog& log() noexcept { return log_; }

 private:
  void take() {
    for (hil::CommandRecord c; loop_.commands().pop(c);) log_.commands.push_back(c);
    bool any = false;
    for (hil::FrameRecord r; loop_.frames().pop(r); any = true) {
      if (r.late > Duration{1'000'000}) ++late_;
      dropped_ += r.skipped_before + (r.handed_over ? 0U : 1U);
      log_.frames.push_back(r);
      // A log gets one line in ten frames, a terminal one line that changes.
      if (!terminal_ && r.sequence % 10 == 0) show(r, '\n');
    }
    if (any && terminal_) show(log_.frames.back(), '\r');
  }

  void show(const hil::FrameRecord& r, char end) const {
    if (quiet_) return;
    const engine::FrameTruth& t = r.report.truth;
    const engine::StageTimes& s = r.report.times;
    const engine::PixelPoint b = scenario_.scene.camera.principal_point();
    std::printf(
        "frame %4llu/%llu  %7.2f km  %6.2f mrad/s  peak %4d DN  error %8.2f px  "
        "ms: render %5.1f optics %4.1f detector %4.1f  late %llu  dropped %llu %c",
        static_cast<unsigned long long>(r.sequence) + 1, static_cast<unsigned long long>(due_),
        t.range_m * 1e-3, t.line_of_sight_rate_rad_s * 1e3, r.report.peak_dn,
        std::hypot(t.photocentre_px.u - b.u, t.photocentre_px.v - b.v), seconds(s.render) * 1e3,
        seconds(s.optics) * 1e3, seconds(s.detector) * 1e3, static_cast<unsigned long long>(late_),
        static_cast<unsigned long long>(dropped_), end);
    std::fflush(stdout);
  }

  const Scenario& scenario_;
  hil::FrameLoop& loop_;
  std::uint64_t due_;
  bool quiet_;
  bool terminal_ = false;
  std::uint64_t late_ = 0;
  std::uint64_t dropped_ = 0;
  RunLog log_;
};

engine::Pass choose_pass(const Scenario& scenario) {
  const std::vector<engine::Pass> passes = passes_of(scenario);
  if (scenario.run.pass > passes.size()) {
    throw engine::ConfigError(
        scenario.run.pass_where + " must be one of the " + std::to_string(passes.size()) +
        " passes that these orbits have, got " + std::to_string(scenario.run.pass));
  }
  return passes[scenario.run.pass - 1];
}

hil::LoopSpec loop_spec(const Scenario& scenario, const engine::Pass& pass) {
  hil::LoopSpec spec;
  spec.start = pass.start;
  spec.period = scenario.run.period;
  Duration lasts = pass.end - pass.start;
  if (scenario.run.duration_s > 0.0)
    lasts = std::min(lasts, engine::from_seconds(scenario.run.duration_s));
  spec.frames = static_cast<std::uint64_t>(lasts / spec.period) + 1;
  spec.exposure = scenario.run.exposure;
  spec.command_lead = scenario.run.command_lead;
  if (scenario.run.clock == ClockMode::kLockstep) {
    spec.when_busy = hil::WhenBusy::kWait;
    spec.answer_timeout = scenario.run.answer_timeout;
    spec.send_timeout = scenario.run.answer_timeout;
  }
  spec.width_px = scenario.scene.camera.width_px;
  spec.height_px = scenario.scene.camera.height_px;
  spec.bits = scenario.detector.bits;
  return spec;
}

std::unique_ptr<hil::Clock> make_clock(const Scenario& scenario, engine::SimTime start) {
  if (scenario.run.clock == ClockMode::kLockstep)
    return std::make_unique<hil::ManualClock>(start - scenario.run.period);
  return std::make_unique<hil::SteadyClock>(start - kRunUp);
}

struct Verdict {
  PointingScore whole;
  PointingScore held;
  bool good = true;
};

Verdict judge(const Scenario& scenario, const RunLog& log, bool open_loop) {
  Verdict v;
  v.whole = score_pointing(scenario, log, 0.0);
  v.held = score_pointing(scenario, log, scenario.criteria.after_s);
  const double limit = scenario.criteria.pointing_rms_px;
  if (!open_loop && limit > 0.0)
    v.good = v.held.frames > 0 && v.held.without_target == 0 && v.held.rms_px <= limit;
  return v;
}

void write_report(const fs::path& folder, const Scenario& s, const engine::Pass& pass,
                  const RunLog& log, const Verdict& v, const PngRecorder& recorder, bool open_loop,
                  int threads) {
  const hil::LoopReport& l = log.loop;
  nlohmann::ordered_json report = {
      {"scenario", s.name},
      {"open_loop", open_loop},
      {"seed", s.scene.seed},
      {"threads", threads},
      {"clock", s.run.clock == ClockMode::kLockstep ? "lockstep" : "realtime"},
      {"pass",
       {{"number", s.run.pass},
        {"start_s", seconds(pass.start)},
        {"end_s", seconds(pass.end)},
        {"closest_s", seconds(pass.closest)},
        {"min_range_km", pass.min_range_m * 1e-3}}},
      {"frames",
       {{"due", l.due},
        {"sent", l.sent},
        {"skipped", l.skipped},
        {"dropped", l.dropped},
        {"faults", l.faults},
        {"late", l.late},
        {"records_lost", l.records_lost}}},
      {"commands",
       {{"taken", l.commands}, {"refused", l.command_faults}, {"lost", l.commands_lost}}},
      {"camera",
       {{"ifov_rad", s.scene.camera.ifov_rad()},
        {"width_px", s.scene.camera.width_px},
        {"height_px", s.scene.camera.height_px}}},
      {"pictures", {{"written", recorder.written()}, {"left_out", recorder.left_out()}}},
      {"answer_missing", l.answer_missing},
      {"command_latency_frames", 1},
      {"pointing",
       {{"after_s", s.criteria.after_s},
        {"rms_px", v.held.rms_px},
        {"worst_px", v.held.worst_px},
        {"frames", v.held.frames},
        {"frames_without_target", v.whole.without_target},
        {"lost_after_s",
         v.whole.lost_after_s ? nlohmann::json(*v.whole.lost_after_s) : nlohmann::json(nullptr)},
        {"limit_px", s.criteria.pointing_rms_px}}},
      {"left_out",
       {"the Earth and stars behind the target", "defocus", "the Sun's disc",
        "PRNU, DSNU and defects"}},
      {"criteria_met", open_loop ? nlohmann::json(nullptr) : nlohmann::json(v.good)}};
  std::ofstream(folder / "report.json") << report.dump(2) << "\n";
}

void print_summary(const RunLog& log, const Verdict& v, const Scenario& s, bool open_loop) {
  const hil::LoopReport& l = log.loop;
  spdlog::info("frames: {} due = {} sent + {} skipped + {} dropped + {} faults; {} late", l.due,
               l.sent, l.skipped, l.dropped, l.faults, l.late);
  spdlog::info("commands: {} taken, {} refused, {} lost", l.commands, l.command_faults,
               l.commands_lost);
  if (v.whole.lost_after_s)
    spdlog::info("the target's centre leaves the frame after {:.1f} s", *v.whole.lost_after_s);
  if (v.whole.without_target > 0)
    spdlog::info("{} frames without any of the target's light", v.whole.without_target);
  if (!open_loop) {
    spdlog::info(
        "pointing error from {:g} s on: {:.3f} px rms, {:.2f} px at worst ({}, limit {:g})",
        s.criteria.after_s, v.held.rms_px, v.held.worst_px, v.good ? "good" : "NOT GOOD ENOUGH",
        s.criteria.pointing_rms_px);
  }
}

}  // namespace

int run_pass(const CommonOptions& options, const RunOptions& run) {
  spdlog::set_pattern("%v");
  if (options.quiet) spdlog::set_level(spdlog::level::warn);
  const Scenario scenario = load_scenario(options);
  const engine::Pass pass = choose_pass(scenario);
  const hil::LoopSpec spec = loop_spec(scenario, pass);
  Rig rig(scenario, options.threads);
  const fs::path folder = make_run_folder(run.out, scenario.name);
  spdlog::info(
      "{}: pass {} from {} UTC, {:.3f} s to {:.3f} s, closest {:.3f} km; {} triangles, "
      "{} threads{}",
      scenario.name, scenario.run.pass,
      engine::utc_text(scenario.scene.epoch + pass.start.time_since_epoch()), seconds(pass.start),
      seconds(pass.end), pass.min_range_m * 1e-3, rig.triangles(), rig.threads(),
      run.open_loop ? "; open loop" : "");

  drivers::MockLink link(spec.width_px, spec.height_px);
  PngRecorder recorder(folder, scenario.run.record_every, spec.width_px, spec.height_px,
                       spec.when_busy);
  hil::FanOut sinks(link, recorder);
  tracker::TrackerSpec tracker_spec = scenario.tracker;
  tracker_spec.reports_only = run.open_loop;
  tracker::Tracker tracker(tracker_spec, spec.width_px, spec.height_px);
  hil::ClosedLoopPointing pointing = make_pointing(scenario, rig, spec.start);
  const std::unique_ptr<hil::Clock> clock = make_clock(scenario, spec.start);
  hil::FrameLoop loop(spec, *clock, pointing, rig.chain(), sinks, link);

  Observer observer(scenario, loop, spec.frames, options.quiet);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  {
    std::stop_source loop_stop;
    std::jthread device([&](const std::stop_token& stop) { run_tracker(link, tracker, stop); });
    std::jthread watcher([&](const std::stop_token& stop) { observer.watch(stop, loop_stop); });
    observer.log().loop = loop.run(loop_stop.get_token());
  }
  recorder.finish();

  const RunLog& log = observer.log();
  const Verdict verdict = judge(scenario, log, run.open_loop);
  write_tables(folder, scenario, log);
  write_report(folder, scenario, pass, log, verdict, recorder, run.open_loop, rig.threads());
  print_summary(log, verdict, scenario, run.open_loop);
  if (!draw_pictures(folder, run.compare))
    spdlog::warn(
        "no contact sheet and no plot: /usr/bin/python3 with matplotlib did not draw them");
  spdlog::info("results: {}", folder.string());
  if (log.loop.answer_missing) {
    spdlog::error("the software under test gave no answer within {:g} s",
                  seconds(scenario.run.answer_timeout));
    return kDeviceFault;
  }
  return verdict.good ? kGood : kCriterionFailed;
}

}  // namespace starloop
