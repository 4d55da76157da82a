#include "tools/chart/probe.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "hil/steady_clock.h"
#include "tools/starloop/rig.h"

namespace chart {
namespace {

constexpr std::size_t kRunsPerRow = 8;  // of a truth mask, on average

double cpu_s() noexcept {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double wall_s() noexcept { return engine::seconds(hil::SteadyClock::stopwatch()); }

std::string text_of(const engine::RenderReport& report) {
  std::string text;
  for (const engine::Rung& rung : report.rungs) {
    if (rung.ladder.empty()) continue;
    if (!text.empty()) text += ", ";
    text += std::string(rung.ladder) + " " + std::string(rung.taken);
  }
  return text;
}

}  // namespace

Probe try_setting(const ChartScene& scene, const std::vector<std::string>& sets,
                  const ProbeSpec& spec) {
  starloop::Scenario scenario = scene.with(sets);
  const engine::SimTime instant = engine::sim_time(scene.time_s);
  const int moving = spec.before + spec.timed;
  const engine::Duration lead = scenario.run.period * moving;
  const engine::SimTime first =
      std::max(engine::SimTime{}, instant - std::min(lead, instant.time_since_epoch()));
  want_frames(scenario, first, instant);
  scenario.run.pattern = true;  // the rig's own generator is not used
  const double begun_s = wall_s();
  starloop::Rig rig(scenario, spec.threads);
  engine::ImagingChain chain = rig.make_chain(scenario);
  const engine::CameraGeometry& camera = scenario.scene.camera;
  Probe probe{.cpu_ms = {},
              .wall_ms = {},
              .stages = {},
              .set_up_s = wall_s() - begun_s,
              .light = LightStack(camera.width_px, camera.height_px, scenario.detector.full_well_e),
              .report = {},
              .mask = engine::TruthMask(kRunsPerRow * static_cast<std::size_t>(camera.height_px)),
              .rungs = {}};
  engine::DnImage frame(camera.width_px, camera.height_px);
  const double to_e = scenario.detector.electrons_per_irradiance(scenario.run.exposure);
  for (int k = 0; k < moving + spec.repeated; ++k) {
    const engine::SimTime open =
        std::max(first, instant - scenario.run.period * std::max(moving - k, 0));
    engine::Shot shot = rig.predicted_shot(open, scenario.run.exposure);
    shot.sequence = static_cast<std::uint64_t>(k);
    const double cpu = cpu_s();
    const double wall = wall_s();
    probe.report = chain.expose(shot, engine::Budget{}, frame, probe.mask);
    if (k >= spec.before && k < moving) {
      probe.cpu_ms.push_back(1e3 * (cpu_s() - cpu));
      probe.wall_ms.push_back(1e3 * (wall_s() - wall));
      probe.stages.push_back(probe.report.times);
    }
    if (k >= moving) probe.light.add(chain.light(), to_e);
  }
  probe.rungs = text_of(probe.report.render);
  return probe;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto last = static_cast<double>(values.size() - 1);
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(std::ceil(std::clamp(share, 0.0, 1.0) * last));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace chart
