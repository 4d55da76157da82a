#include <cstring>

#include <spdlog/spdlog.h>

#include "engine/orbit/utc.h"
#include "tools/starloop/flight.h"
#include "tools/starloop/observer.h"
#include "tools/starloop/orbit_notes.h"
#include "tools/starloop/subcommands.h"
#include "tools/starloop/verdict.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::seconds;

void introduce(const Flight::Plan& plan, const Rig& rig, const Flight& flight) {
  const Scenario& scenario = plan.scenario;
  const engine::Pass& pass = plan.pass;
  spdlog::info(
      "{}: pass {} from {} UTC, {:.3f} s to {:.3f} s, closest {:.3f} km{}; {} triangles, "
      "{} threads{}",
      scenario.name, scenario.run.pass,
      engine::utc_text(scenario.scene.epoch + pass.start.time_since_epoch()), seconds(pass.start),
      seconds(pass.end), pass.min_range_m * 1e-3,
      pass.truncated() ? " (goes on beyond the search)" : "", rig.triangles(), rig.threads(),
      plan.open_loop ? "; open loop" : "");
  for (const std::string& note : orbit_notes(scenario, pass.closest)) spdlog::info("{}", note);
  if (const std::string note = leap_second_note(scenario); !note.empty()) spdlog::warn("{}", note);
  if (!rig.star_text().empty()) spdlog::info("{}", rig.star_text());
  for (const std::string& note : rig.material_notes()) spdlog::info("{}", note);
  spdlog::info("{}", flight.text());
}

/// A disk that was full or slow is no reason to stop, and none to keep quiet.
void complain(const hil::RecorderReport& kept) {
  if (kept.records_lost > 0)
    spdlog::warn("record.slog: {} records lost ({}: {}); this run cannot be replayed in full",
                 kept.records_lost, kept.log_fault.step, std::strerror(kept.log_fault.code));
  if (kept.failed > 0 || !kept.failure.empty())
    spdlog::warn("{} frames not kept: {}", kept.failed, kept.failure);
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

int run_pass(const CommonOptions& options, RunOptions run) {
  ScenarioSource source = read_source(options);
  if (run.pattern) source.overrides.emplace_back("run.pattern=true");
  const Scenario scenario = load_scenario(source);
  // There is nothing to point at, and nothing to judge.
  run.open_loop = run.open_loop || scenario.run.pattern;
  const Flight::Plan plan{source, scenario, chosen_pass(scenario), run.open_loop, options.quiet};
  Rig rig(scenario, options.threads);
  Flight flight(plan, rig);
  introduce(plan, rig, flight);
  catch_signals();
  if (!flight.wait_for_reader()) {
    spdlog::error("nobody reads the frames after {:g} s", seconds(scenario.run.start_timeout));
    return kDeviceFault;
  }

  const fs::path folder = make_run_folder(run.out, scenario.name);
  const Flight::Result result = flight.fly(folder, {.reports_only = run.open_loop});
  const RunLog& log = result.log;
  complain(result.kept);
  const Verdict verdict = judge(scenario, log, run.open_loop);
  write_tables(folder, scenario, log);
  write_detections(folder, log, verdict.detection.score);
  write_report(folder, scenario, log, verdict,
               {.pass = plan.pass,
                .open_loop = run.open_loop,
                .threads = rig.threads(),
                .recorder = result.kept,
                .links = result.links,
                .faults_injected = result.faults_injected,
                .command_port = result.command_port,
                .truth = result.truth,
                .image_quality = result.image_quality});
  print_summary(scenario, log, verdict, run.open_loop);
  if (const std::string line = summary_of(result.image_quality); !line.empty())
    spdlog::info("{}", line);
  if (!run.no_pictures) draw(folder, run.compare);
  spdlog::info("results: {}", folder.string());
  if (const int code = failure_of(log.loop, scenario.run); code != kGood) return code;
  return verdict.good ? kGood : kCriterionFailed;
}

}  // namespace starloop
