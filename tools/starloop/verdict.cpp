#include "tools/starloop/verdict.h"

#include <fstream>
#include <string>
#include <vector>

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

namespace starloop {
namespace {

using engine::Duration;
using engine::seconds;

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

nlohmann::ordered_json refusals_json(const hil::RefusalCounts& refused) {
  nlohmann::ordered_json by_cause;
  for (std::size_t i = 0; i < hil::kRefusals; ++i)
    by_cause[name(static_cast<hil::Refusal>(i))] = refused.by_cause[i];
  return by_cause;
}

void print_detections(const DetectionVerdict& verdict) {
  const hil::DetectionScore& d = verdict.score;
  spdlog::info("detections: {} = {} matches + {} false alarms + {} duplicates + {} strays",
               d.detections, d.matches, d.false_alarms, d.duplicates, d.strays);
  spdlog::info("detected in {} of the {} frames that show the target; centroid {:.3f} px rms",
               d.detected, d.detectable, d.centroid_rms_px);
  for (const std::string& sentence : verdict.not_met) spdlog::error("{}", sentence);
}

/// What the scenario asks to leave out, and what no model has yet.
std::vector<std::string> left_out(const Scenario& s) {
  std::vector<std::string> list;
  const engine::DetectorSpec& d = s.detector;
  const bool all_alike = d.prnu_rms == 0.0 && d.dsnu_rms == 0.0 && d.prnu_map.path.empty() &&
                         d.dsnu_map.path.empty() && d.hot_pixels == 0.0 && d.dead_pixels == 0.0 &&
                         d.hot_columns == 0 && d.dead_columns == 0;
  if (all_alike) list.emplace_back("PRNU, DSNU and defects");
  if (!s.scene.earth.in_frame) list.emplace_back("the Earth behind the target");
  if (s.stars.source == engine::StarSpec::Source::kNone) list.emplace_back("stars");
  const bool hard = s.render.method == engine::RenderMethod::kLattice;
  if (s.render.sun_disc == engine::SunDisc::kOff)
    list.emplace_back("the Sun's disc");
  else if (hard)
    list.emplace_back("the Sun's disc in shadows");
  if (!s.companions.empty()) list.emplace_back("companions' smear: the frame has the target's");
  if (!s.parts.empty()) list.emplace_back("that parts turn while the shutter is open");
  return list;
}

/// Frames by what they left out.
nlohmann::ordered_json shed_json(const hil::LoopReport& report) {
  nlohmann::ordered_json json;
  for (std::size_t i = 0; i < report.by_shed.size(); ++i)
    json[std::string(name_of(static_cast<engine::Shed>(i)))] = report.by_shed[i];
  return json;
}

}  // namespace

Verdict judge(const Scenario& scenario, const RunLog& log, bool open_loop) {
  Verdict v;
  v.whole = score_pointing(scenario, log, 0.0);
  v.held = score_pointing(scenario, log, scenario.criteria.after_s);
  const double limit = scenario.criteria.pointing_rms_px;
  if (!open_loop && limit > 0.0)
    v.held_good = v.held.frames > 0 && v.held.without_target == 0 && v.held.rms_px <= limit;
  v.detection =
      judge_detections(scenario.criteria.detection, scenario.scene.camera, log, open_loop);
  v.good = v.held_good && v.detection.not_met.empty();
  return v;
}

void write_report(const std::filesystem::path& folder, const Scenario& s, const RunLog& log,
                  const Verdict& v, const RunFacts& facts) {
  const hil::LoopReport& l = log.loop;
  const hil::RecorderReport& kept = facts.recorder;
  const engine::Pass& pass = facts.pass;
  const bool open_loop = facts.open_loop;
  nlohmann::ordered_json report = {
      {"scenario", s.name},
      {"open_loop", open_loop},
      {"seed", s.scene.seed},
      {"threads", facts.threads},
      {"clock", name_of(s.run.clock)},
      {"pass",
       {{"number", s.run.pass},
        {"start_s", seconds(pass.start)},
        {"end_s", seconds(pass.end)},
        {"closest_s", seconds(pass.closest)},
        {"min_range_km", pass.min_range_m * 1e-3},
        {"start_limited_by", name_of(pass.start_limited_by)},
        {"end_limited_by", name_of(pass.end_limited_by)},
        {"truncated", pass.truncated()}}},
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
        {"left_out_for_want_of_time", shed_json(l)},
        {"records_lost", l.records_lost}}},
      {"commands",
       {{"taken", l.commands},
        {"malformed", l.command_faults},
        {"refused", l.refused.total()},
        {"refused_by_cause", refusals_json(l.refused)},
        {"lost", l.commands_lost}}},
      {"links", facts.links},
      {"faults_injected", facts.faults_injected},
      {"command_port", facts.command_port},
      {"camera",
       {{"ifov_rad", s.scene.camera.ifov_rad()},
        {"width_px", s.scene.camera.width_px},
        {"height_px", s.scene.camera.height_px}}},
      {"pictures", {{"written", kept.kept}, {"left_out", kept.left_out}, {"failed", kept.failed}}},
      {"log", {{"records", kept.records}, {"lost", kept.records_lost}}},
      {"truth", facts.truth},
      {"image_quality", facts.image_quality},
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
        {"limit_px", s.criteria.pointing_rms_px},
        {"met", open_loop ? nlohmann::json(nullptr) : nlohmann::json(v.held_good)}}},
      {"statistics", statistics_json(log)},
      {"detection", detection_json(v.detection)},
      {"left_out", left_out(s)},
      {"criteria_met", open_loop ? nlohmann::json(nullptr) : nlohmann::json(v.good)}};
  std::ofstream(folder / "report.json") << report.dump(2) << "\n";
}

void print_summary(const Scenario& s, const RunLog& log, const Verdict& v, bool open_loop) {
  const hil::LoopReport& l = log.loop;
  spdlog::info("frames: {} due = {} sent + {} skipped + {} dropped + {} faults; {} late", l.due,
               l.sent, l.skipped, l.dropped, l.faults, l.late);
  const auto delayed = l.due - l.skipped - of_cause(l, hil::LateCause::kNone);
  if (delayed > 0)
    spdlog::info(
        "{} frames late or after skipped ones: {} our own work, {} the machine, {} unknown",
        delayed, of_cause(l, hil::LateCause::kOwnWork), of_cause(l, hil::LateCause::kMachine),
        of_cause(l, hil::LateCause::kUnknown));
  if (const auto [whole, upkeep, samples, bounces, shadows] = l.by_shed;
      upkeep + samples + bounces + shadows > 0)
    spdlog::info(
        "for want of time {} frames left out the upkeep of kept light, {} samples, too, {} "
        "bounces, too, {} rays for shadows, too; {} were whole",
        upkeep, samples, bounces, shadows, whole);
  if (log.machine)
    spdlog::info("the machine's own stalls: p99.9 {:.2f} ms, worst {:.2f} ms",
                 seconds(log.machine->quantile(0.999)) * 1e3, seconds(log.machine->worst()) * 1e3);
  spdlog::info("commands: {} taken, {} malformed, {} refused, {} lost", l.commands,
               l.command_faults, l.refused.total(), l.commands_lost);
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
        s.criteria.after_s, v.held.rms_px, v.held.worst_px,
        v.held_good ? "good" : "NOT GOOD ENOUGH", s.criteria.pointing_rms_px);
  }
  if (!v.held_good) {
    spdlog::error(
        "the pointing error from {:g} s on is {:.4g} px rms over {} frames, {} of the "
        "run's without target, and must be at most {:g}",
        s.criteria.after_s, v.held.rms_px, v.held.frames, v.whole.without_target,
        s.criteria.pointing_rms_px);
  }
  print_detections(v.detection);
}

}  // namespace starloop
