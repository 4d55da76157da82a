#include <cstring>
#include <stop_token>

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "engine/orbit/utc.h"
#include "tools/starloop/connections.h"
#include "tools/starloop/observer.h"
#include "tools/starloop/subcommands.h"
#include "tools/starloop/verdict.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Duration;
using engine::seconds;

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

void introduce(const Scenario& scenario, const engine::Pass& pass, const Rig& rig,
               const Connections& connections, bool open_loop) {
  spdlog::info(
      "{}: pass {} from {} UTC, {:.3f} s to {:.3f} s, closest {:.3f} km; {} triangles, "
      "{} threads{}",
      scenario.name, scenario.run.pass,
      engine::utc_text(scenario.scene.epoch + pass.start.time_since_epoch()), seconds(pass.start),
      seconds(pass.end), pass.min_range_m * 1e-3, rig.triangles(), rig.threads(),
      open_loop ? "; open loop" : "");
  spdlog::info("{}", connections.text());
}

/// A disk that was full or slow is no reason to stop, and none to keep quiet.
void complain(const hil::RecorderReport& kept) {
  if (kept.records_lost > 0)
    spdlog::warn("record.slog: {} records lost ({}: {}); this run cannot be replayed in full",
                 kept.records_lost, kept.log_fault.step, std::strerror(kept.log_fault.code));
  if (kept.failed > 0 || !kept.failure.empty())
    spdlog::warn("{} frames not kept: {}", kept.failed, kept.failure);
}

/// Runs the loop with its observer beside it; the calling thread is the loop's.
void run_loop(hil::FrameLoop& loop, Observer& observer, Pacing& pacing) {
  std::stop_source loop_stop;
  const std::jthread watcher([&](const std::stop_token& stop) { observer.watch(stop, loop_stop); });
  const std::string granted = pacing.enter_realtime();
  if (!granted.empty()) spdlog::info("real time: {}", granted);
  const hil::LoopReport report = loop.run(loop_stop.get_token());
  const hil::WakeHistogram* wakes = pacing.finish();
  // The observer leaves these alone.
  observer.log().loop = report;
  observer.log().realtime = granted;
  if (wakes != nullptr) observer.log().machine = *wakes;
}

void draw(const fs::path& folder, const std::string& compare) {
  if (!draw_pictures(folder, compare))
    spdlog::warn(
        "no contact sheet and no plot: /usr/bin/python3 with matplotlib did not draw them");
  if (!write_page(folder))
    spdlog::warn("no report.html: /usr/bin/python3 with matplotlib did not write it");
}

/// What ended a run before its time, as an exit code; kGood: nothing did.
int failure_of(const hil::LoopReport& report, const RunSpec& run) {
  if (report.trigger_missing) {
    spdlog::error("nobody pulled the trigger within {:g} s", seconds(run.trigger_timeout));
    return kDeviceFault;
  }
  if (report.answer_missing) {
    spdlog::error("the software under test gave no answer within {:g} s",
                  seconds(run.answer_timeout));
    return kDeviceFault;
  }
  return kGood;
}

}  // namespace

int run_pass(const CommonOptions& options, const RunOptions& run) {
  spdlog::set_pattern("%v");
  if (options.quiet) spdlog::set_level(spdlog::level::warn);
  const ScenarioSource source = read_source(options);
  const Scenario scenario = load_scenario(source);
  const engine::Pass pass = choose_pass(scenario);
  Pacing pacing(scenario, pass.start, length_of(scenario, pass), run.open_loop);
  const hil::LoopSpec& spec = pacing.loop_spec();
  Rig rig(scenario, options.threads);
  Connections connections(scenario, spec);
  introduce(scenario, pass, rig, connections, run.open_loop);
  catch_signals();
  if (!pacing.wait_for_reader(connections.link(), interrupted)) {
    spdlog::error("nobody reads the frames after {:g} s", seconds(scenario.run.start_timeout));
    return kDeviceFault;
  }

  const fs::path folder = make_run_folder(run.out, scenario.name);
  const auto store = make_store(folder, scenario, scenario.run.record_frames);
  hil::Recorder recorder({.log_path = (folder / "record.slog").string(),
                          .sync_every = scenario.run.sync_every,
                          .record_every = scenario.run.record_every,
                          .when_busy = spec.when_busy},
                         log_start(source, scenario, spec, rig.threads()), store.get());
  TruthRecorder truth({.folder = folder,
                       .picture_every = scenario.run.record_every,
                       .width_px = spec.width_px,
                       .height_px = spec.height_px,
                       .when_busy = spec.when_busy});
  hil::ClosedLoopPointing pointing = make_pointing(scenario, rig, spec.start);
  pacing.start();
  connections.start(pacing.clock(), run.open_loop);
  hil::FanOut recorders(recorder, truth);
  hil::FanOut sinks(connections.frames(), recorders);
  const auto loop = std::make_unique<hil::FrameLoop>(spec, pacing.clock(), pointing, rig.chain(),
                                                     sinks, connections.commands());
  Observer observer(scenario, {*loop, recorder, truth, connections.faults()}, spec.frames,
                    options.quiet);
  run_loop(*loop, observer, pacing);
  connections.stop();

  const RunLog& log = observer.log();
  const hil::RecorderReport kept = recorder.finish(log.loop);
  complain(kept);
  truth.finish();
  const Verdict verdict = judge(scenario, log, run.open_loop);
  write_tables(folder, scenario, log);
  write_detections(folder, log, verdict.detection.score);
  write_report(folder, scenario, log, verdict,
               {.pass = pass,
                .open_loop = run.open_loop,
                .threads = rig.threads(),
                .recorder = kept,
                .faults_injected = connections.faults_json(),
                .command_port = connections.port_json(),
                .truth = truth.json()});
  print_summary(scenario, log, verdict, run.open_loop);
  draw(folder, run.compare);
  spdlog::info("results: {}", folder.string());
  if (const int code = failure_of(log.loop, scenario.run); code != kGood) return code;
  return verdict.good ? kGood : kCriterionFailed;
}

}  // namespace starloop
