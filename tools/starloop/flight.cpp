#include "tools/starloop/flight.h"

#include <stop_token>

#include <spdlog/spdlog.h>

#include "tools/starloop/observer.h"

namespace starloop {
namespace {

using engine::Duration;

Duration length_of(const Scenario& scenario, const engine::Pass& pass) {
  const Duration whole = pass.end - pass.start;
  if (scenario.run.duration_s <= 0.0) return whole;
  return std::min(whole, engine::from_seconds(scenario.run.duration_s));
}

/// Runs the loop with its observer beside it.
void run_loop(hil::FrameLoop& loop, Observer& observer, Pacing& pacing, bool quiet) {
  std::stop_source loop_stop;
  const std::jthread watcher([&](const std::stop_token& stop) { observer.watch(stop, loop_stop); });
  const std::string granted = pacing.enter_realtime();
  if (!granted.empty() && !quiet) spdlog::info("real time: {}", granted);
  const hil::LoopReport report = loop.run(loop_stop.get_token());
  const hil::WakeHistogram* wakes = pacing.finish();
  // The observer leaves these alone.
  observer.log().loop = report;
  observer.log().realtime = granted;
  if (wakes != nullptr) observer.log().machine = *wakes;
}

/// Of a test pattern there is nothing to say.
std::optional<quality::CameraFigures> scored_camera(const Scenario& scenario) {
  if (!scenario.run.record_quality || scenario.run.pattern) return std::nullopt;
  return quality::CameraFigures{scenario.detector.largest_dn(), scenario.detector.gain_e_dn()};
}

}  // namespace

Flight::Flight(const Plan& plan, Rig& rig)
    : plan_(plan),
      rig_(rig),
      pacing_(plan.scenario, plan.pass.start, length_of(plan.scenario, plan.pass), plan.open_loop),
      connections_(plan.scenario, pacing_.loop_spec()) {}

Flight::~Flight() = default;

bool Flight::wait_for_reader() const {
  return pacing_.wait_for_reader(connections_.link(), interrupted);
}

Flight::Result Flight::fly(const std::filesystem::path& folder, const DeviceManner& manner) {
  const Scenario& scenario = plan_.scenario;
  const hil::LoopSpec& spec = pacing_.loop_spec();
  const auto store = make_store(folder, scenario, scenario.run.record_frames);
  hil::Recorder recorder({.log_path = (folder / "record.slog").string(),
                          .sync_every = scenario.run.sync_every,
                          .record_every = scenario.run.record_every,
                          .when_busy = spec.when_busy},
                         log_start(plan_.source, scenario, spec, rig_.threads()), store.get());
  TruthRecorder truth({.folder = folder,
                       .picture_every = scenario.run.record_every,
                       .width_px = spec.width_px,
                       .height_px = spec.height_px,
                       .companions = companion_names(scenario),
                       .parts = part_names(scenario),
                       .camera = scored_camera(scenario),
                       .when_busy = spec.when_busy});
  hil::ClosedLoopPointing pointing = make_pointing(scenario, rig_, spec.start);
  run_up(scenario, rig_, spec.start);
  pacing_.start();
  connections_.start(pacing_.clock(), manner);
  hil::FanOut recorders(recorder, truth);
  hil::FanOut sinks(connections_.frames(), recorders);
  const auto loop = std::make_unique<hil::FrameLoop>(
      spec, pacing_.clock(), pointing, rig_.generator(), sinks, connections_.commands());
  Observer observer(scenario, {*loop, recorder, truth, connections_.faults()}, spec.frames,
                    plan_.quiet);
  run_loop(*loop, observer, pacing_, plan_.quiet);
  connections_.stop();

  Result result;
  result.log = std::move(observer.log());
  result.kept = recorder.finish(result.log.loop);
  truth.finish();
  result.links = connections_.links_json();
  result.faults_injected = connections_.faults_json();
  result.command_port = connections_.port_json();
  result.truth = truth.json();
  result.image_quality = truth.quality_json();
  return result;
}

}  // namespace starloop
