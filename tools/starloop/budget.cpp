#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/chart/probe.h"
#include "tools/starloop/provenance.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

using chart::ChartScene;
using chart::LightError;
using chart::Probe;

// Frames before those that are timed: what is kept on the target is there by then.
constexpr chart::ProbeSpec kTrial{.before = 12, .timed = 24, .repeated = 2, .threads = 1};
constexpr double kReferenceSamples = 4e6;  // of all lit pixels together
constexpr std::size_t kStages = 4;
constexpr std::array<const char*, kStages> kStageNames = {"geometry", "render", "optics",
                                                          "detector"};

/// What a frame is expected to be like at an instant.
struct Expected {
  double time_s = 0;
  engine::FrameTruth truth;
  std::array<double, kStages> stage_ms{};  ///< medians
  double frame_ms = 0;
  double worst_ms = 0;  ///< of kTrial.timed
  std::string rungs;
  std::optional<LightError> error;

  [[nodiscard]] std::size_t slowest() const {
    return static_cast<std::size_t>(std::max_element(stage_ms.begin(), stage_ms.end()) -
                                    stage_ms.begin());
  }
};

std::array<double, kStages> medians_of(const std::vector<engine::StageTimes>& stages) {
  std::array<std::vector<double>, kStages> ms;
  for (const engine::StageTimes& t : stages) {
    const std::array<engine::Duration, kStages> each = {t.geometry, t.render, t.optics, t.detector};
    for (std::size_t i = 0; i < kStages; ++i) ms[i].push_back(1e3 * engine::seconds(each[i]));
  }
  std::array<double, kStages> medians{};
  for (std::size_t i = 0; i < kStages; ++i) medians[i] = chart::quantile(ms[i], 0.5);
  return medians;
}

Expected expect_at(const ChartScene& scene, const Scenario& scenario, int threads,
                   bool with_errors) {
  chart::ProbeSpec spec = kTrial;
  spec.threads = threads;
  const Probe probe = chart::try_setting(scene, {}, spec);
  Expected expected{.time_s = scene.time_s,
                    .truth = probe.report.truth,
                    .stage_ms = medians_of(probe.stages),
                    .frame_ms = chart::quantile(probe.wall_ms, 0.5),
                    .worst_ms = chart::quantile(probe.wall_ms, 1.0),
                    .rungs = probe.rungs,
                    .error = std::nullopt};
  const int lit_px = expected.truth.mask_px;
  if (!with_errors || lit_px == 0) return expected;
  const int samples = static_cast<int>(std::clamp(kReferenceSamples / lit_px, 64.0, 4000.0));
  const Probe reference =
      chart::try_setting(scene, chart::reference_setting(samples).sets, {0, 0, 2, threads});
  expected.error =
      chart::PixelSorter(reference.light, reference.mask, scenario.detector, scenario.run.exposure)
          .compare(probe.light);
  return expected;
}

std::vector<double> times_of(const Scenario& scenario, const BudgetOptions& options) {
  if (!options.times_s.empty()) return options.times_s;
  const engine::Pass pass = chosen_pass(scenario);
  const auto at = [](engine::SimTime t) { return engine::seconds(t.time_since_epoch()); };
  const double start = at(pass.start);
  const double closest = at(pass.closest);
  const double end = at(pass.end);
  return {start, 0.5 * (start + closest), closest, 0.5 * (closest + end), end};
}

const Expected& slowest_of(const std::vector<Expected>& all) {
  return *std::max_element(all.begin(), all.end(), [](const Expected& a, const Expected& b) {
    return a.frame_ms < b.frame_ms;
  });
}

void print_error(const std::optional<LightError>& error) {
  if (!error) {
    std::printf("%8s%8s%9s%9s\n", "-", "-", "-", "-");
    return;
  }
  std::printf("%8.2f%8.2f%+8.2f%%%9.3f\n", error->lit.rho, error->edge.rho,
              100.0 * error->flux_share, error->centroid_px);
}

void print(const Scenario& s, const std::vector<Expected>& all, int threads) {
  const double period_ms = 1e3 * engine::seconds(s.run.period);
  std::printf("%s on %s, %d threads: %d x %d px, %.6g ms a frame\n", s.name.c_str(),
              provenance().processor.c_str(), threads, s.scene.camera.width_px,
              s.scene.camera.height_px, period_ms);
  std::printf("%12s%10s%8s | ms:%6s%8s%8s%9s%8s%8s |%7s%8s%9s%9s\n", "time s", "range km", "lit px",
              "geom.", "render", "optics", "detector", "whole", "worst", "lit", "edge", "flux",
              "px");
  for (const Expected& e : all) {
    std::printf("%12.3f%10.2f%8d |    ", e.time_s, e.truth.range_m * 1e-3, e.truth.mask_px);
    std::printf("%6.2f%8.2f%8.2f%9.2f%8.2f%8.2f |", e.stage_ms[0], e.stage_ms[1], e.stage_ms[2],
                e.stage_ms[3], e.frame_ms, e.worst_ms);
    print_error(e.error);
  }
  const Expected& slowest = slowest_of(all);
  std::printf(
      "%s limits the frame rate, at %.1f km: %.1f Hz by the median of %d frames, %.1f by "
      "their worst; links and the software under test come on top\n",
      kStageNames[slowest.slowest()], slowest.truth.range_m * 1e-3, 1e3 / slowest.frame_ms,
      kTrial.timed, 1e3 / slowest.worst_ms);
  if (slowest.worst_ms > period_ms)
    std::printf("%s: frames that take longer than %.6g ms %s\n",
                slowest.frame_ms > period_ms ? "too slow for this rate" : "too slow now and then",
                period_ms,
                s.run.sheds ? "make the next ones leave something out (run.overload)"
                            : "cost the ones that they overlap, or time where no clock paces");
  std::printf(
      "errors are over the sensor's noise (lit: all pixels of the target; edge: of these, "
      "steep ones), of all light, and of its centre\n");
  std::string rungs;
  for (const Expected& e : all) {
    if (e.rungs == rungs) continue;
    rungs = e.rungs;
    std::printf("from %.3f s: %s\n", e.time_s, rungs.empty() ? "nothing to render" : rungs.c_str());
  }
}

nlohmann::ordered_json json_of(const std::optional<LightError>& error) {
  if (!error) return nullptr;
  const auto of = [](const chart::ClassError& e) {
    // A number that is none becomes null.
    return nlohmann::ordered_json{
        {"px", e.px}, {"rho", e.rho}, {"bias", e.bias}, {"reference", e.reference}};
  };
  return {{"lit", of(error->lit)},
          {"edge", of(error->edge)},
          {"sky", of(error->sky)},
          {"flux_share", error->flux_share},
          {"centroid_px", error->centroid_px}};
}

void print_json(const Scenario& s, const std::vector<Expected>& all, int threads) {
  const Provenance made_with = provenance();
  nlohmann::ordered_json json = {{"scenario", s.name},
                                 {"processor", made_with.processor},
                                 {"commit", made_with.commit},
                                 {"threads", threads},
                                 {"period_ms", 1e3 * engine::seconds(s.run.period)},
                                 {"instants", nlohmann::ordered_json::array()}};
  for (const Expected& e : all) {
    nlohmann::ordered_json stages;
    for (std::size_t i = 0; i < kStages; ++i) stages[kStageNames[i]] = e.stage_ms[i];
    json["instants"].push_back({{"time_s", e.time_s},
                                {"range_km", e.truth.range_m * 1e-3},
                                {"lit_px", e.truth.mask_px},
                                {"stage_ms", stages},
                                {"frame_ms", e.frame_ms},
                                {"worst_ms", e.worst_ms},
                                {"limited_by", kStageNames[e.slowest()]},
                                {"rungs", e.rungs},
                                {"error", json_of(e.error)}});
  }
  json["frame_rate_hz"] = 1e3 / slowest_of(all).frame_ms;
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int plan_budget(const CommonOptions& options, const BudgetOptions& budget) {
  const Scenario scenario = load_scenario(options);
  const int threads = worker_threads(options.threads);
  ChartScene scene;
  scene.options = options;
  std::vector<Expected> all;
  for (const double time_s : times_of(scenario, budget)) {
    scene.time_s = time_s;
    all.push_back(expect_at(scene, scenario, threads, !budget.without_errors));
  }
  if (budget.as_json) {
    print_json(scenario, all, threads);
  } else {
    print(scenario, all, threads);
  }
  return kGood;
}

}  // namespace starloop
