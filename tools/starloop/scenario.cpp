#include "tools/starloop/scenario.h"

#include <algorithm>

#include "engine/core/constants.h"
#include "engine/orbit/utc.h"
#include "hil/telemetry_row.h"

namespace starloop {
namespace {

using engine::ConfigReader;
using engine::ConfigTable;
using engine::Duration;
using engine::from_seconds;

engine::Epoch read_epoch(const ConfigTable& table) {
  const std::string text = table.text("epoch");
  const auto epoch = engine::epoch_from_utc(text);
  if (!epoch)
    table.fail("epoch", "must be a UTC date like 2022-01-01T00:00:00, from " +
                            std::to_string(engine::kFirstYear) + " to " +
                            std::to_string(engine::kLastYear) + ", got \"" + text + "\"");
  return *epoch;
}

RunSpec read_run(const ConfigTable& table) {
  RunSpec run;
  run.pass = static_cast<std::size_t>(table.integer("pass", engine::at_least(1.0)));
  run.pass_where = table.where("pass");
  run.duration_s = table.number_or("duration_s", 0.0, engine::at_least(0.0));
  run.pattern = table.flag_or("pattern", run.pattern);
  run.exposure = from_seconds(table.number("exposure_ms", engine::between(1e-3, 1e5)) * 1e-3);
  run.period = from_seconds(1.0 / table.number("frame_rate_hz", engine::between(0.01, 1000.0)));
  run.command_lead =
      from_seconds(table.number_or("command_lead_ms", 20.0, engine::between(0.0, 1e5)) * 1e-3);
  run.answer_timeout =
      from_seconds(table.number_or("answer_timeout_s", 10.0, engine::between(0.1, 3600.0)));
  run.clock = table.choice_or<ClockMode>("clock", "realtime",
                                         {{"realtime", ClockMode::kRealtime},
                                          {"lockstep", ClockMode::kLockstep},
                                          {"as-fast-as-possible", ClockMode::kAsFastAsPossible},
                                          {"triggered", ClockMode::kTriggered}});
  // No other run asks a clock.
  run.sheds = table.choice_or<bool>("overload", "shed", {{"shed", true}, {"skip", false}}) &&
              run.clock == ClockMode::kRealtime;
  run.trigger = table.text_or("trigger", "packet");
  run.trigger_where = table.where("trigger");
  run.trigger_timeout =
      from_seconds(table.number_or("trigger_timeout_s", 60.0, engine::between(0.1, 1e6)));
  run.start_timeout =
      from_seconds(table.number_or("start_timeout_s", 30.0, engine::between(0.0, 1e6)));
  run.record_every =
      static_cast<std::uint64_t>(table.integer_or("record_every", 10, engine::at_least(1.0)));
  if (run.exposure + run.command_lead > run.period) {
    table.fail("exposure_ms", "and command_lead_ms must fit into one period of " +
                                  std::to_string(engine::seconds(run.period) * 1e3) + " ms");
  }
  return run;
}

/// What a clock decides can be told afterwards, not beforehand: only in a run that is paced by one.
Duration read_deadline(const ConfigTable& table, const RunSpec& run, engine::RenderMethod method) {
  if (table.is_text("deadline_ms"))
    return table.choice_or<Duration>("deadline_ms", "none", {{"none", Duration{}}});
  if (!table.has("deadline_ms")) return {};
  const double longest_ms = engine::seconds(run.period) * 1e3;
  const Duration deadline =
      from_seconds(table.number("deadline_ms", engine::between(0.1, longest_ms)) * 1e-3);
  if (run.clock != ClockMode::kRealtime)
    table.fail("deadline_ms", "needs run.clock = \"realtime\": no other run asks a clock");
  if (method != engine::RenderMethod::kPaths)
    table.fail("deadline_ms", "needs render.method = \"paths\": no other stops half-way");
  return deadline;
}

bool several_bodies(const Scenario& s) {
  return !s.companions.empty() || (!s.parts.empty() && !s.parts_frozen_at);
}

// What the lattice does not know: other bodies, fine grids, and stopping half-way.
bool wants_paths(const ConfigTable& render, const Scenario& s) {
  return several_bodies(s) || s.optics.oversampling > engine::RenderSpec::kMostOfLattice ||
         (render.has("deadline_ms") && !render.is_text("deadline_ms"));
}

void read_record(const ConfigTable& table, RunSpec& run) {
  run.record_frames = table.choice_or<RecordFrames>("frames", "png",
                                                    {{"none", RecordFrames::kNone},
                                                     {"png", RecordFrames::kPng},
                                                     {"fits", RecordFrames::kFits},
                                                     {"cube", RecordFrames::kCube},
                                                     {"raw", RecordFrames::kRaw}});
  run.record_quality = table.flag_or("quality", true);
  run.sync_every = from_seconds(table.number_or("sync_s", 5.0, engine::between(0.0, 3600.0)));
}

tracker::TrackerSpec read_tracker(const ConfigTable& table, const engine::CameraGeometry& camera) {
  tracker::TrackerSpec spec;
  spec.ifov_rad = camera.ifov_rad();
  spec.boresight_off_px = {camera.principal_point().u - std::floor(0.5 * camera.width_px),
                           camera.principal_point().v - std::floor(0.5 * camera.height_px)};
  spec.threshold_sigma =
      table.number_or("threshold_sigma", spec.threshold_sigma, engine::positive());
  spec.alpha = table.number_or("alpha", spec.alpha, engine::between(0.0, 1.0));
  spec.beta = table.number_or("beta", spec.beta, engine::between(0.0, 2.0));
  return spec;
}

/// North is up and east to the left, turned about the boresight by the roll.
std::optional<engine::CameraAttitude> read_boresight(const ConfigTable& table) {
  if (!table.has("boresight_ra_deg") && !table.has("boresight_dec_deg")) return std::nullopt;
  using engine::kDegree;
  const double ra = table.number("boresight_ra_deg", engine::between(-180.0, 360.0)) * kDegree;
  const double dec = table.number("boresight_dec_deg", engine::between(-90.0, 90.0)) * kDegree;
  const double roll =
      table.number_or("boresight_roll_deg", 0.0, engine::between(-360.0, 360.0)) * kDegree;
  const Eigen::Vector3d z = engine::unit_at(ra, dec);
  const Eigen::Vector3d west(std::sin(ra), -std::cos(ra), 0.0);
  const Eigen::Vector3d south = z.cross(west);
  engine::CameraAttitude attitude;
  attitude.axes.matrix.row(0) = std::cos(roll) * west + std::sin(roll) * south;
  attitude.axes.matrix.row(1) = std::cos(roll) * south - std::sin(roll) * west;
  attitude.axes.matrix.row(2) = z;
  return attitude;
}

/// The camera's part in what can be seen: its field, where it stays in the sky, and its noise.
void complete_visibility(const ConfigTable& table, Scenario& s) {
  const engine::CameraGeometry& camera = s.scene.camera;
  if (table.flag_or("in_field", false)) {
    if (!s.boresight) table.fail("in_field", "needs guidance.boresight_ra_deg and _dec_deg");
    const Eigen::Vector3d first = camera.straight_direction_at({-0.5, -0.5});
    const Eigen::Vector3d last =
        camera.straight_direction_at({camera.width_px - 0.5, camera.height_px - 0.5});
    s.visibility.field = {s.boresight->axes, first.x(), last.x(), first.y(), last.y()};
  }
  if (!s.visibility.signal) return;
  engine::SignalLimit& signal = *s.visibility.signal;
  signal.sun_w_m2 = sun_irradiance_w_m2(s.scene.sun, engine::kAstronomicalUnit_m);
  signal.ifov_rad = camera.ifov_rad();
  // Light at the pupil spreads over the detector as the radiance of one pixel's angle does.
  signal.electrons_per_w_m2 = throughput_sr(s.optics) / (signal.ifov_rad * signal.ifov_rad) *
                              s.detector.electrons_per_irradiance(s.run.exposure);
  signal.dark_noise_e = s.detector.noise_e(s.detector.dark_mean_e(s.run.exposure));
}

/// One of few periods to an exposure is a line of the jitter, whose path each exposure integrates.
void take_slow_vibration(Scenario& s) {
  engine::VibrationSpec& vibration = s.optics.vibration;
  const double periods = vibration.frequency_hz * engine::seconds(s.run.exposure);
  if (vibration.amplitude_rad == 0.0 || vibration.frequency_hz == 0.0 ||
      periods >= engine::VibrationSpec::kFewPeriods)
    return;
  s.slow_vibration = {
      {{vibration.frequency_hz, vibration.amplitude_rad, vibration.direction_rad, 0.0}}, {}, {}};
  s.jitter.lines.push_back(s.slow_vibration.lines.front());
  vibration = {};
}

}  // namespace

Scenario read_scenario(const ConfigReader& config) {
  Scenario s;
  const ConfigTable scenario = config.table("scenario");
  s.name = scenario.text("name");
  if (s.name.empty() || s.name.find_first_of("/\\") != std::string::npos || s.name[0] == '.')
    scenario.fail("name", "must be usable as a folder's name, got \"" + s.name + "\"");
  s.scene.epoch = read_epoch(scenario);
  s.scene.seed = static_cast<std::uint64_t>(scenario.integer_or("seed", 1, engine::at_least(0.0)));
  s.scene.light_path = scenario.choice_or<engine::LightPath>(
      "light_path", "apparent",
      {{"apparent", engine::LightPath::kApparent}, {"geometric", engine::LightPath::kGeometric}});
  s.run = read_run(config.table("run"));
  read_record(config.table("record"), s.run);
  const ConfigTable criteria = config.table("criteria");
  s.criteria = {criteria.number_or("pointing_rms_px", 0.0, engine::at_least(0.0)),
                criteria.number_or("after_s", 0.0, engine::at_least(0.0)),
                hil::read_criteria(criteria)};
  s.camera_orbit = engine::read_orbit(config.table("orbit.camera"));
  s.target_orbit = engine::read_orbit(config.table("orbit.target"));

  s.scene.camera = engine::read_camera_geometry(config.table("camera"));
  s.scene.sun = engine::read_sun(config.table("sun"));
  s.scene.earth = engine::read_earth(config.table("earth"));
  s.scene.target_attitude = engine::read_attitude(config.table("target"));
  s.scene.sky_w_m2_sr =
      config.table("sky").number_or("radiance_w_m2_sr", 0.0, engine::at_least(0.0));
  s.stars = engine::read_stars(config.table("stars"));
  const ConfigTable visibility = config.table("visibility");
  s.visibility = engine::read_visibility(visibility, s.scene.sun.model,
                                         s.scene.camera.half_diagonal_field_rad());
  s.scene.shadow = s.visibility.shadow;
  s.search_span = from_seconds(
      visibility.number_or("span_days", 15.0, engine::between(0.001, 1000.0)) * 86400.0);

  s.mesh = engine::read_mesh_spec(config, "target");
  s.companions = engine::read_companions(config);
  s.parts = engine::read_parts(config, s.companions);
  s.materials = engine::read_materials(config);
  s.optics = engine::read_optics(config.table("optics"), s.scene.camera);
  s.optics.stars = s.stars.source != engine::StarSpec::Source::kNone;
  s.render = engine::read_render(config.table("render"));
  if (config.table("render").has("parts_frozen_at_s"))
    s.parts_frozen_at = engine::sim_time(
        config.table("render").number("parts_frozen_at_s", engine::between(0.0, 1e9)));
  if (s.render.method_by_need && wants_paths(config.table("render"), s))
    s.render.method = engine::RenderMethod::kPaths;
  s.run.render_time = read_deadline(config.table("render"), s.run, s.render.method);
  s.render.camera = s.scene.camera;
  if (several_bodies(s) && s.render.method != engine::RenderMethod::kPaths)
    config.table("render").fail("method", "must be \"paths\" where there are companions or parts");
  if (s.optics.oversampling > engine::RenderSpec::kMostOfLattice &&
      s.render.method != engine::RenderMethod::kPaths)
    config.table("render").fail("method", "must be \"paths\" where the optics want " +
                                              std::to_string(s.optics.oversampling) +
                                              " cells to a pixel's side");
  s.detector = engine::read_detector(config.table("detector"), s.scene.camera.pixel_pitch_m,
                                     s.scene.sun.mean_wavelength_m);
  s.detector.binning = s.scene.camera.window.binning;
  s.guidance = hil::read_guidance_error(config.table("guidance"));
  s.mode = hil::read_guidance_mode(config.table("guidance"));
  s.target_knowledge = hil::read_target_knowledge(config.table("guidance"));
  s.roll = config.table("guidance")
               .choice_or<hil::RollRule>("roll", "celestial",
                                         {{"celestial", hil::RollRule::kCelestial},
                                          {"vertical", hil::RollRule::kVertical}});
  s.boresight = read_boresight(config.table("guidance"));
  complete_visibility(visibility, s);
  s.actuator = hil::read_actuator(config.table("actuator"));
  s.realtime = hil::read_realtime(config.table("realtime"));
  s.link = drivers::read_link(config.table("link"));
  if (s.link.telemetry_row &&
      (s.scene.camera.width_px < static_cast<int>(hil::kTelemetryRowPixels) ||
       s.detector.bits < hil::kTelemetryRowBits)) {
    config.table("link").fail("telemetry_row", "needs a camera of at least 56 columns and 8 bits");
  }
  s.port = hil::read_command_port(config.table("command_port"));
  s.faults = hil::read_faults(config, s.scene.seed, s.scene.camera.width_px, s.detector.bits);
  s.jitter = hil::read_jitter(config);
  take_slow_vibration(s);
  s.sensors = hil::read_sensors(config.table("sensors"));
  s.tracker = read_tracker(config.table("tracker"), s.scene.camera);
  s.tracker.black_dn = s.detector.pedestal_dn;
  config.reject_unknown_keys();
  if (s.parts_frozen_at) want_frames(s, *s.parts_frozen_at, *s.parts_frozen_at);
  return s;
}

engine::SensorMaps sensor_maps(const Scenario& scenario) {
  const engine::CameraGeometry& camera = scenario.scene.camera;
  const engine::SensorWindow& window = camera.window;
  const engine::SensorMaps sensor(scenario.detector, window.sensor_width_px * window.binning,
                                  window.sensor_height_px * window.binning);
  return sensor.binned(window.binning)
      .cut({window.left_px, window.top_px, window.left_px + camera.width_px,
            window.top_px + camera.height_px});
}

std::vector<std::string> companion_names(const Scenario& scenario) {
  std::vector<std::string> names;
  for (const engine::CompanionSpec& spec : scenario.companions) names.push_back(spec.name);
  return names;
}

std::vector<std::string> part_names(const Scenario& scenario) {
  std::vector<std::string> names;
  for (const engine::PartSpec& part : scenario.parts) {
    names.push_back(part.owner == 0 ? part.name
                                    : scenario.companions[part.owner - 1].name + "." + part.name);
  }
  return names;
}

ScenarioSource read_source(const CommonOptions& options) {
  ScenarioSource source{options.file, engine::scenario_text(options.file), options.overrides};
  if (options.seed_given)
    source.overrides.push_back("scenario.seed=" + std::to_string(options.seed));
  return source;
}

Scenario load_scenario(const ScenarioSource& source) {
  ConfigReader config = ConfigReader::from_text(source.text, source.file);
  for (const std::string& assignment : source.overrides) config.set(assignment);
  return read_scenario(config);
}

Scenario load_scenario(const CommonOptions& options) { return load_scenario(read_source(options)); }

std::unique_ptr<const engine::Propagator> propagator_of(const Scenario& scenario,
                                                        const engine::OrbitSpec& orbit) {
  const engine::Epoch epoch = scenario.scene.epoch;
  const Duration lasts = std::max(scenario.search_span, scenario.latest.time_since_epoch());
  return engine::make_propagator(orbit, epoch, {epoch, epoch + lasts});
}

namespace {

/// Frames by shutters that open in between, light's way and guidance that aims ahead included.
void need_orbits(const Scenario& scenario, engine::SimTime first, engine::SimTime last) {
  constexpr Duration kNearlyFull = Duration::max() - std::chrono::hours(2 * 8766);
  const Duration begun = std::max(scenario.scene.epoch.time_since_epoch(), Duration{});
  if (last.time_since_epoch() > kNearlyFull - begun)
    throw engine::ConfigError("--time is too late: an epoch holds 292 years from 2000 on");
  // Light's way from as far as anything is seen in Earth orbit.
  constexpr Duration kLightTime{1'000'000'000};
  const Duration apparent =
      scenario.scene.light_path == engine::LightPath::kApparent ? kLightTime : Duration{};
  const Duration ahead = from_seconds(scenario.target_knowledge.ahead_s);
  const engine::Epoch begin = scenario.scene.epoch + first.time_since_epoch();
  const engine::Epoch end = scenario.scene.epoch + last.time_since_epoch() + scenario.run.exposure;
  engine::need_span(scenario.camera_orbit, {begin, end});
  engine::need_span(scenario.target_orbit, {begin - apparent + std::min(ahead, Duration{}),
                                            end + std::max(ahead, Duration{})});
  for (const engine::CompanionSpec& companion : scenario.companions)
    if (companion.orbit) engine::need_span(*companion.orbit, {begin - apparent, end});
  engine::need_span(scenario.scene.target_attitude, {begin - apparent, end});
  for (const engine::CompanionSpec& companion : scenario.companions)
    engine::need_span(companion.attitude, {begin - apparent, end});
}

}  // namespace

void want_frames(Scenario& scenario, engine::SimTime first, engine::SimTime last) {
  need_orbits(scenario, first, last);
  scenario.latest = std::max(scenario.latest, last + scenario.run.exposure);
}

std::vector<engine::Pass> passes_of(const Scenario& scenario) {
  const engine::Epoch epoch = scenario.scene.epoch;
  for (const engine::OrbitSpec* orbit : {&scenario.camera_orbit, &scenario.target_orbit})
    engine::need_span(*orbit, {epoch, epoch + scenario.search_span});
  const auto camera = propagator_of(scenario, scenario.camera_orbit);
  const auto target = propagator_of(scenario, scenario.target_orbit);
  return engine::find_passes(*camera, *target, scenario.visibility, epoch, engine::SimTime{},
                             engine::SimTime{scenario.search_span});
}

engine::Pass chosen_pass(const Scenario& scenario) {
  const std::vector<engine::Pass> passes = passes_of(scenario);
  if (scenario.run.pass > passes.size()) {
    throw engine::ConfigError(
        scenario.run.pass_where + " must be one of the " + std::to_string(passes.size()) +
        " passes that these orbits have, got " + std::to_string(scenario.run.pass));
  }
  const engine::Pass& pass = passes[scenario.run.pass - 1];
  need_orbits(scenario, pass.start, pass.end);
  return pass;
}

}  // namespace starloop
