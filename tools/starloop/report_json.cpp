#include "tools/starloop/report_json.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace starloop {

namespace fs = std::filesystem;
using engine::Duration;
using engine::seconds;
using Json = nlohmann::ordered_json;

namespace {

Json json_of(const hil::Percentiles& p, const char* unit) {
  Json json = {{"unit", unit}, {"count", p.count}};
  const auto add = [&](const char* key, double figure) {
    json[key] = p.count > 0 ? Json(figure) : Json(nullptr);
  };
  add("p50", p.p50);
  add("p99", p.p99);
  add("p99_9", p.p99_9);
  add("max", p.max);
  return json;
}

Json or_null(const std::optional<double>& figure) { return figure ? Json(*figure) : Json(nullptr); }

/// A figure that means nothing when nothing was counted.
Json if_any(std::uint64_t count, double figure) { return count > 0 ? Json(figure) : Json(nullptr); }

/// Of the frames where it is known.
Json render_noise_of(const RunLog& log) {
  std::vector<double> sigmas;
  for (const hil::FrameRecord& r : log.frames)
    if (r.handed_over && std::isfinite(r.report.render.rho_mc.rms))
      sigmas.push_back(r.report.render.rho_mc.rms);
  return json_of(hil::percentiles_of(std::move(sigmas)), "sigma");
}

/// Of the frames that were handed over: the others were not rendered.
template <class Time>
Json times_of(const RunLog& log, const Time& time) {
  std::vector<double> ms;
  ms.reserve(log.frames.size());
  for (const hil::FrameRecord& r : log.frames)
    if (r.handed_over) ms.push_back(seconds(time(r)) * 1e3);
  return json_of(hil::percentiles_of(std::move(ms)), "ms");
}

}  // namespace

DetectionVerdict judge_detections(const hil::DetectionCriteria& criteria,
                                  const engine::CameraGeometry& camera, const RunLog& log,
                                  bool open_loop) {
  DetectionVerdict verdict;
  verdict.score =
      hil::score_detections(log.frames, log.commands, criteria.rules, camera.principal_point());
  if (open_loop) return verdict;
  verdict.criteria = hil::judge_detections(criteria, verdict.score);
  verdict.not_met = hil::criteria_not_met(verdict.criteria);
  return verdict;
}

Json statistics_json(const RunLog& log) {
  using Record = hil::FrameRecord;
  std::vector<double> late;
  late.reserve(log.frames.size());
  for (const Record& r : log.frames) late.push_back(seconds(r.late) * 1e3);
  std::vector<double> latency;
  latency.reserve(log.commands.size());
  for (const hil::CommandRecord& c : log.commands)
    if (c.frame > c.command.answers_frame)
      latency.push_back(static_cast<double>(c.frame - c.command.answers_frame));
  return {{"latency", json_of(hil::percentiles_of(std::move(latency)), "frames")},
          {"late", json_of(hil::percentiles_of(std::move(late)), "ms")},
          {"busy", times_of(log, [](const Record& r) { return r.busy; })},
          {"geometry", times_of(log, [](const Record& r) { return r.report.times.geometry; })},
          {"render", times_of(log, [](const Record& r) { return r.report.times.render; })},
          {"optics", times_of(log, [](const Record& r) { return r.report.times.optics; })},
          {"render_noise", render_noise_of(log)},
          {"detector", times_of(log, [](const Record& r) { return r.report.times.detector; })}};
}

Json detection_json(const DetectionVerdict& verdict) {
  const hil::DetectionScore& s = verdict.score;
  Json criteria = Json::array();
  for (const hil::JudgedCriterion& c : verdict.criteria) {
    criteria.push_back({{"key", c.key},
                        {"limit", c.limit},
                        {"reached", or_null(c.reached)},
                        {"met", c.met},
                        {"sentence", c.sentence}});
  }
  const std::size_t n = s.centroid_error_px.count;
  Json centroid = json_of(s.centroid_error_px, "px");
  centroid["rms"] = if_any(n, s.centroid_rms_px);
  centroid["p95"] = if_any(n, s.centroid_p95_px);
  centroid["bias_u"] = if_any(n, s.centroid_bias_px.u);
  centroid["bias_v"] = if_any(n, s.centroid_bias_px.v);
  return {{"frames", s.frames},
          {"answered", s.answered},
          {"unanswered", s.unanswered},
          {"detectable", s.detectable},
          {"detected", s.detected},
          {"detections", s.detections},
          {"matches", s.matches},
          {"false_alarms", s.false_alarms},
          {"duplicates", s.duplicates},
          {"strays", s.strays},
          {"detection_rate", or_null(s.detection_rate)},
          {"false_alarms_per_frame", or_null(s.false_alarms_per_frame)},
          {"centroid_error", std::move(centroid)},
          {"boxes", s.boxes},
          {"box_iou_mean", if_any(s.boxes, s.box_iou_mean)},
          {"latency_frames", json_of(s.latency_frames, "frames")},
          {"acquisition_s", or_null(s.acquisition_s)},
          {"time_on_target", or_null(s.time_on_target)},
          {"criteria", std::move(criteria)}};
}

void write_detections(const fs::path& folder, const RunLog& log, const hil::DetectionScore& score) {
  const fs::path path = folder / "detections.csv";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "w"),
                                                             &std::fclose);
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
  std::fprintf(file.get(),
               "frame,time_s,visible_fraction,signal_to_noise,mask_px,answered,detectable,found,"
               "false_alarms,error_u_px,error_v_px,box_iou,latency_frames\n");
  auto verdict = score.verdicts.begin();
  for (const hil::FrameRecord& r : log.frames) {
    if (!r.handed_over || verdict == score.verdicts.end()) continue;
    const hil::FrameVerdict& v = *verdict++;
    const engine::FrameTruth& t = r.report.truth;
    const double latency = v.latency_frames ? static_cast<double>(*v.latency_frames) : std::nan("");
    std::fprintf(file.get(), "%llu,%.9f,%.6f,%.4f,%d,%d,%d,%d,%u,%.4f,%.4f,%.4f,%g\n",
                 static_cast<unsigned long long>(v.sequence), seconds(r.shutter_open),
                 t.visible_fraction, t.signal_to_noise, t.mask_px, v.answered ? 1 : 0,
                 v.detectable ? 1 : 0, v.found ? 1 : 0, v.false_alarms, v.error_px.u, v.error_px.v,
                 v.box_iou.value_or(std::nan("")), latency);
  }
}

}  // namespace starloop
