#include "tools/starloop/rig.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <thread>
#include <utility>

#include "engine/core/constants.h"
#include "engine/render/mesh_levels.h"
#include "hil/steady_clock.h"
#include "tools/starloop/pattern.h"
#include "tools/starloop/scene_bodies.h"

namespace starloop {
namespace {

// A wing of light is followed to where it is this share of the noise of a dark pixel: the default
// profile's limit for all model errors together.
constexpr double kUnseenShareOfNoise = 0.3;

std::string text_of(const engine::StarCatalogue& stars, const engine::CameraGeometry& camera) {
  char text[240];
  std::snprintf(text, sizeof text,
                "%zu stars; %zu without a colour of their own, %zu without proper motion: half of "
                "these are off by more than %.2f\" = %.2f px",
                stars.stars.size(), stars.without_colour, stars.without_motion,
                stars.median_error_rad() / engine::kDegree * 3600.0,
                stars.median_error_rad() / camera.ifov_rad());
  return text;
}

/// Of the materials that bodies have. What a surface does not send everywhere alike may shine.
engine::EarthshineSensor earthshine_sensor(const engine::SensorNoise& noise,
                                           const std::vector<engine::Material>& materials,
                                           const std::set<std::string>& used) {
  engine::EarthshineSensor sensor;
  sensor.e_per_radiance = noise.e_per_radiance;
  sensor.dark_variance_e2 = noise.dark_variance_e2;
  sensor.unseen_sigmas = kUnseenShareOfNoise;
  sensor.diffuse_albedo = 0;
  sensor.glossy_albedo = 0;
  for (const engine::Material& m : materials) {
    if (!used.contains(m.name)) continue;
    sensor.diffuse_albedo = std::max(sensor.diffuse_albedo, m.diffuse_albedo());
    sensor.glossy_albedo = std::max(sensor.glossy_albedo, m.glossy_albedo());
  }
  return sensor;
}

}  // namespace

int worker_threads(int wanted) {
  if (wanted > 0) return wanted;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

double faint_irradiance_w_m2(const Scenario& scenario) {
  const engine::DetectorSpec& detector = scenario.detector;
  const double dark_e = detector.dark_mean_e(scenario.run.exposure);
  return kUnseenShareOfNoise * detector.noise_e(dark_e) /
         detector.electrons_per_irradiance(scenario.run.exposure);
}

Rig::Rig(const Scenario& scenario, int threads)
    : epoch_(scenario.scene.epoch),
      path_(scenario.scene.light_path),
      roll_(scenario.roll),
      boresight_(scenario.boresight),
      slow_vibration_(scenario.slow_vibration, scenario.scene.seed, engine::SimTime{}),
      camera_(propagator_of(scenario, scenario.camera_orbit)),
      target_(propagator_of(scenario, scenario.target_orbit)),
      believed_target_(*target_, scenario.target_knowledge),
      pool_(worker_threads(threads)) {
  if (scenario.run.pattern) {
    generator_ = std::make_unique<PatternGenerator>(scenario.detector.bits);
    return;
  }
  generator_ = std::make_unique<engine::ImagingChain>(make_chain(scenario));
}

engine::ImagingChain Rig::make_chain(const Scenario& scenario) {
  Stages stages = make_stages(scenario);
  return {stages.scene,
          std::move(stages.renderer),
          std::move(stages.optics),
          engine::Detector(scenario.detector, pool_, sensor_maps(scenario)),
          scenario.detector,
          scenario.scene.camera,
          &hil::SteadyClock::stopwatch,
          std::move(stages.stars)};
}

Rig::Stages Rig::make_stages(const Scenario& scenario) {
  const engine::DetectorSpec& detector = scenario.detector;
  engine::Optics optics(scenario.optics, faint_irradiance_w_m2(scenario), pool_);
  engine::RenderSpec render = scenario.render;
  render.grid = optics.wish();
  const double noise_e = detector.noise_e(detector.dark_mean_e(scenario.run.exposure));
  render.noise = {optics.throughput_sr() * detector.electrons_per_irradiance(scenario.run.exposure),
                  noise_e * noise_e, detector.full_well_e, optics.noise_blur_px()};
  render.clock = &hil::SteadyClock::stopwatch;
  engine::SceneSpec scene = scenario.scene;
  const std::vector<engine::Companion> companions = move_companions(scenario);
  const auto builder_with = [&](std::vector<engine::ArticulatedPart> parts) {
    return engine::SnapshotBuilder(scene, *camera_, *target_, companions, std::move(parts));
  };
  std::vector<engine::ArticulatedPart> parts(scenario.parts.begin(), scenario.parts.end());
  std::optional<engine::Snapshot> frozen;
  if (scenario.parts_frozen_at)
    frozen = builder_with(std::exchange(parts, {}))
                 .build(predicted_shot(*scenario.parts_frozen_at, scenario.run.exposure));
  const SceneBodies bodies = make_bodies(scenario, frozen ? &*frozen : nullptr);
  triangles_ = bodies.triangles();
  material_notes_ = bodies.material_notes();
  scene.earthshine_sensor = earthshine_sensor(render.noise, scenario.materials, bodies.materials());
  if (render.mesh_level == engine::MeshLevelChoice::kAuto && bodies.others.empty())
    engine::add_mesh_levels(*bodies.target, scenario.materials, render);
  std::unique_ptr<engine::Starlight> stars;
  if (scenario.stars.source != engine::StarSpec::Source::kNone) {
    const engine::StarCatalogue catalogue =
        engine::read_star_catalogue(scenario.stars, scenario.scene.epoch);
    star_text_ = text_of(catalogue, scenario.scene.camera);
    stars = std::make_unique<engine::Starlight>(
        engine::StarField(catalogue, scenario.scene.camera,
                          engine::StarLight(detector.mean_wavelength_m)),
        optics.splat(), detector);
  }
  return {builder_with(std::move(parts)),
          engine::make_renderer(render, bodies.target, pool_, bodies.others), std::move(optics),
          std::move(stars)};
}

std::vector<engine::Companion> Rig::move_companions(const Scenario& scenario) {
  const std::vector<engine::CompanionSpec>& specs = scenario.companions;
  const std::size_t first = companions_.size();
  companions_.resize(first + specs.size());
  // Those that are held come after what they are held to.
  const auto make = [&](const auto& self, std::size_t i) -> const engine::Propagator& {
    std::unique_ptr<const engine::Propagator>& place = companions_[first + i];
    if (place == nullptr && specs[i].orbit)
      place = propagator_of(scenario, *specs[i].orbit);
    else if (place == nullptr && specs[i].beside == 0)
      place = std::make_unique<engine::HeldOffset>(*target_, specs[i].offset);
    else if (place == nullptr)
      place =
          std::make_unique<engine::HeldOffset>(self(self, specs[i].beside - 1), specs[i].offset);
    return *place;
  };
  const auto upright_of = [&](std::size_t i) -> const engine::Propagator& {
    while (!specs[i].orbit) {
      if (specs[i].beside == 0) return *target_;
      i = specs[i].beside - 1;
    }
    return *companions_[first + i];
  };
  for (std::size_t i = 0; i < specs.size(); ++i) make(make, i);
  std::vector<engine::Companion> moving;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    moving.push_back(
        {*companions_[first + i], upright_of(i), engine::BodyAttitude(specs[i].attitude, epoch_)});
  }
  return moving;
}

engine::Shot Rig::predicted_shot(engine::SimTime open, engine::Duration exposure) const {
  hil::ClosedLoopPointing pointing(prediction(), hil::PointingSpec{}, slow_vibration_);
  engine::Shot shot;
  shot.shutter_open = open;
  shot.exposure = exposure;
  shot.attitude = hil::track_over(pointing, open, exposure, [] {});
  return shot;
}

hil::ScriptedPointing Rig::prediction() const {
  return {*camera_, *target_, epoch_, path_, roll_, boresight_};
}

hil::ScriptedPointing Rig::believed() const {
  return {*camera_, believed_target_, epoch_, path_, roll_, boresight_};
}

void run_up(const Scenario& scenario, Rig& rig, engine::SimTime start) {
  constexpr int kFrames = 8;
  // Frames with a deadline are paths', which keep nothing and would take all their samples here.
  if (scenario.run.clock != ClockMode::kRealtime || !scenario.run.sheds ||
      scenario.run.render_time > engine::Duration{})
    return;
  const engine::Shot shot = rig.predicted_shot(start, scenario.run.exposure);
  engine::DnImage pixels;
  pixels.resize(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  engine::TruthMask mask;
  for (int i = 0; i < kFrames; ++i) rig.generator().expose(shot, engine::Budget{}, pixels, mask);
}

hil::ClosedLoopPointing make_pointing(const Scenario& scenario, const Rig& rig,
                                      engine::SimTime start) {
  hil::PointingSpec spec;
  spec.mode = scenario.mode;
  spec.error = scenario.guidance;
  spec.error.start = start;
  spec.actuator = scenario.actuator;
  spec.sensors = scenario.sensors;
  spec.seed = scenario.scene.seed;
  return {rig.believed(), spec, hil::Jitter(scenario.jitter, spec.seed, start)};
}

}  // namespace starloop
