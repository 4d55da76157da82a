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
#include "hil/faults/faulty_commands.h"
#include "hil/faults/faulty_sink.h"
#include "tools/starloop/pacing.h"
#include "tools/starloop/run_folder.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Duration;
using engine::seconds;

constexpr Duration kPatience{20'000'000};

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
  Observer(const Scenario& scenario, hil::FrameLoop& loop, std::array<hil::FaultRing*, 2> faults,
           std::uint64_t frames, bool quiet)
      : scenario_(scenario), loop_(loop), faults_(faults), due_(frames), quiet_(quiet) {
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
    for (hil::FaultRing* ring : faults_)
      for (hil::FaultRecord f; ring->pop(f);) log_.faults.push_back(f);
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
  std::array<hil::FaultRing*, 2> faults_;  // of frames, of commands
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

Duration length_of(const Scenario& scenario, const engine::Pass& pass) {
  const Duration whole = pass.end - pass.start;
  if (scenario.run.duration_s <= 0.0) return whole;
  return std::min(whole, engine::from_seconds(scenario.run.duration_s));
}

const char* name_of(ClockMode mode) {
  switch (mode) {
    case ClockMode::kRealtime:
      return "realtime";
    case ClockMode::kLockstep:
      return "lockstep";
    case ClockMode::kAsFastAsPossible:
      return "as-fast-as-possible";
    case ClockMode::kTriggered:
      return "triggered";
  }
  return "";
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

nlohmann::ordered_json json_of(const hil::WakeHistogram& wakes) {
  const auto us = [](Duration d) { return seconds(d) * 1e6; };
  return {{"wakes", wakes.count()},
          {"p50_us", us(wakes.quantile(0.5))},
          {"p99_us", us(wakes.quantile(0.99))},
          {"p99.9_us", us(wakes.quantile(0.999))},
          {"max_us", us(wakes.worst())}};
}

std::uint64_t of_cause(const hil::LoopReport& report, hil::LateCause cause) {
  return report.late_by_cause[static_cast<std::size_t>(cause)];
}

nlohmann::ordered_json faults_injected(const hil::FaultSpec& spec, const hil::FaultySink& frames,
                                       const hil::FaultyCommands& commands) {
  nlohmann::ordered_json by_name = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < spec.faults.size(); ++i)
    by_name[spec.faults[i].name] = frames.happened()[i] + commands.happened()[i];
  const hil::FrameFaultCounts& f = frames.counts();
  const hil::CommandFaultCounts& c = commands.counts();
  return {{"by_name", by_name},
          {"frames",
           {{"taken", f.taken},
            {"delivered", f.delivered},
            {"dropped", f.dropped},
            {"away", f.away},
            {"refused", f.refused},
            {"held", f.held},
            {"copies", f.copies}}},
          {"commands",
           {{"taken", c.taken},
            {"delivered", c.delivered},
            {"lost", c.lost},
            {"refused", c.refused},
            {"held", c.held},
            {"copies", c.copies},
            {"stand_ins", c.stand_ins}}},
          {"records_lost", f.records_lost + c.records_lost}};
}

void write_report(const fs::path& folder, const Scenario& s, const engine::Pass& pass,
                  const RunLog& log, const Verdict& v, const PngRecorder& recorder,
                  const nlohmann::ordered_json& faults, bool open_loop, int threads) {
  const hil::LoopReport& l = log.loop;
  nlohmann::ordered_json report = {
      {"scenario", s.name},
      {"open_loop", open_loop},
      {"seed", s.scene.seed},
      {"threads", threads},
      {"clock", name_of(s.run.clock)},
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
        {"late_or_after_skipped_by_cause",
         {{"own_work", of_cause(l, hil::LateCause::kOwnWork)},
          {"machine", of_cause(l, hil::LateCause::kMachine)},
          {"unknown", of_cause(l, hil::LateCause::kUnknown)}}},
        {"records_lost", l.records_lost}}},
      {"commands",
       {{"taken", l.commands}, {"refused", l.command_faults}, {"lost", l.commands_lost}}},
      {"faults_injected", faults},
      {"camera",
       {{"ifov_rad", s.scene.camera.ifov_rad()},
        {"width_px", s.scene.camera.width_px},
        {"height_px", s.scene.camera.height_px}}},
      {"pictures", {{"written", recorder.written()}, {"left_out", recorder.left_out()}}},
      {"answer_missing", l.answer_missing},
      {"command_latency_frames", 1},
      {"realtime", log.realtime},
      {"machine_hiccups", log.machine ? json_of(*log.machine) : nlohmann::ordered_json(nullptr)},
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
  const auto delayed = l.due - l.skipped - of_cause(l, hil::LateCause::kNone);
  if (delayed > 0)
    spdlog::info(
        "{} frames late or after skipped ones: {} our own work, {} the machine, {} unknown",
        delayed, of_cause(l, hil::LateCause::kOwnWork), of_cause(l, hil::LateCause::kMachine),
        of_cause(l, hil::LateCause::kUnknown));
  if (log.machine)
    spdlog::info("the machine's own stalls: p99.9 {:.2f} ms, worst {:.2f} ms",
                 seconds(log.machine->quantile(0.999)) * 1e3, seconds(log.machine->worst()) * 1e3);
  spdlog::info("commands: {} taken, {} refused, {} lost", l.commands, l.command_faults,
               l.commands_lost);
  if (v.whole.lost_after_s)
    spdlog::info("the target's centre leaves the frame after {:.1f} s", *v.whole.lost_after_s);
  if (v.whole.without_target > 0)
    spdlog::info("{} frames without any of the target's light", v.whole.without_target);
  if (!open_loop && v.held.frames == 0) {
    spdlog::info("no frame shows the target from {:g} s on: the pointing is not judged good",
                 s.criteria.after_s);
  } else if (!open_loop) {
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
  Pacing pacing(scenario, pass.start, length_of(scenario, pass));
  const hil::LoopSpec& spec = pacing.loop_spec();
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
  tracker::TrackerSpec tracker_spec = scenario.tracker;
  tracker_spec.reports_only = run.open_loop;
  tracker::Tracker tracker(tracker_spec, spec.width_px, spec.height_px);
  hil::GuidanceError guidance = scenario.guidance;
  guidance.start = spec.start;
  hil::ClosedLoopPointing pointing(rig.prediction(), guidance, scenario.actuator);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (!pacing.wait_for_reader(link, [] { return interrupted != 0; })) {
    spdlog::error("nobody reads the frames after {:g} s", seconds(scenario.run.start_timeout));
    return kDeviceFault;
  }
  pacing.start();
  const bool lockstep = scenario.run.clock == ClockMode::kLockstep;
  hil::FaultySink faulty(scenario.faults, {spec.width_px, spec.height_px}, spec.start, link,
                         lockstep ? nullptr : &pacing.clock());
  hil::FaultyCommands faulty_commands(
      scenario.faults, link, faulty.news(),
      lockstep ? hil::FaultyCommands::Pace::kLockstep : hil::FaultyCommands::Pace::kRealtime);
  hil::FanOut sinks(faulty, recorder);
  hil::FrameLoop loop(spec, pacing.clock(), pointing, rig.chain(), sinks, faulty_commands);
  Observer observer(scenario, loop, {&faulty.records(), &faulty_commands.records()}, spec.frames,
                    options.quiet);
  {
    std::stop_source loop_stop;
    std::jthread device([&](const std::stop_token& stop) { run_tracker(link, tracker, stop); });
    std::jthread watcher([&](const std::stop_token& stop) { observer.watch(stop, loop_stop); });
    observer.log().realtime = pacing.enter_realtime();
    if (!observer.log().realtime.empty()) spdlog::info("real time: {}", observer.log().realtime);
    observer.log().loop = loop.run(loop_stop.get_token());
  }
  if (const hil::WakeHistogram* wakes = pacing.finish()) observer.log().machine = *wakes;
  recorder.finish();

  const RunLog& log = observer.log();
  const Verdict verdict = judge(scenario, log, run.open_loop);
  write_tables(folder, scenario, log);
  write_report(folder, scenario, pass, log, verdict, recorder,
               faults_injected(scenario.faults, faulty, faulty_commands), run.open_loop,
               rig.threads());
  print_summary(log, verdict, scenario, run.open_loop);
  if (!draw_pictures(folder, run.compare))
    spdlog::warn(
        "no contact sheet and no plot: /usr/bin/python3 with matplotlib did not draw them");
  spdlog::info("results: {}", folder.string());
  if (log.loop.trigger_missing) {
    spdlog::error("nobody pulled the trigger within {:g} s", seconds(scenario.run.trigger_timeout));
    return kDeviceFault;
  }
  if (log.loop.answer_missing) {
    spdlog::error("the software under test gave no answer within {:g} s",
                  seconds(scenario.run.answer_timeout));
    return kDeviceFault;
  }
  return verdict.good ? kGood : kCriterionFailed;
}

}  // namespace starloop
