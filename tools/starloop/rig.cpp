#include "tools/starloop/rig.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <thread>

#include "engine/core/constants.h"
#include "engine/render/mesh_levels.h"
#include "engine/render/traced_target.h"
#include "engine/scene/telescope.h"
#include "hil/steady_clock.h"
#include "tools/starloop/pattern.h"

namespace starloop {
namespace {

// A wing of light is followed to where it is this share of the noise of a dark pixel: the default
// profile's limit for all model errors together.
constexpr double kUnseenShareOfNoise = 0.3;

engine::Mesh load_mesh(const std::string& name) {
  if (name == "telescope") return engine::telescope_mesh();
  engine::MeshReport report;
  engine::Mesh mesh = engine::load_obj(name, report);
  if (report.left_out() > 0)
    std::fprintf(stderr, "%s: %zu faces left out: %zu not finite, %zu without area\n", name.c_str(),
                 report.left_out(), report.not_finite, report.zero_area);
  return mesh;
}

/// The target's first. Bodies of one mesh share it.
std::vector<std::shared_ptr<engine::TracedTarget>> traced_bodies(const Scenario& scenario) {
  std::map<std::string, std::shared_ptr<engine::TracedTarget>> by_mesh;
  std::vector<std::shared_ptr<engine::TracedTarget>> bodies;
  const auto add = [&](const std::string& mesh, const std::string& where) {
    std::shared_ptr<engine::TracedTarget>& shape = by_mesh[mesh];
    try {
      if (shape == nullptr)
        shape = std::make_shared<engine::TracedTarget>(load_mesh(mesh), scenario.materials);
    } catch (const engine::ConfigError& e) {
      throw engine::ConfigError(where + ": " + e.what());
    }
    bodies.push_back(shape);
  };
  add(scenario.mesh, scenario.mesh_where);
  for (const engine::CompanionSpec& companion : scenario.companions)
    add(companion.mesh, companion.mesh_where);
  return bodies;
}

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

/// By its parameters a surface is diffuse with an albedo of pi kd; the energy it has left may
/// shine.
engine::EarthshineSensor earthshine_sensor(const engine::SensorNoise& noise,
                                           const std::vector<engine::Material>& materials) {
  engine::EarthshineSensor sensor;
  sensor.e_per_radiance = noise.e_per_radiance;
  sensor.dark_variance_e2 = noise.dark_variance_e2;
  sensor.unseen_sigmas = kUnseenShareOfNoise;
  sensor.diffuse_albedo = 0;
  sensor.glossy_albedo = 0;
  for (const engine::Material& m : materials) {
    const double diffuse = std::min(1.0, engine::kPi * m.parameters.kd);
    sensor.diffuse_albedo = std::max(sensor.diffuse_albedo, diffuse);
    if (m.parameters.kb > 0.0) sensor.glossy_albedo = std::max(sensor.glossy_albedo, 1 - diffuse);
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
  Stages stages = make_stages(scenario);
  generator_ = std::make_unique<engine::ImagingChain>(
      stages.scene, std::move(stages.renderer), std::move(stages.optics),
      engine::Detector(scenario.detector, pool_, sensor_maps(scenario)), scenario.detector,
      scenario.scene.camera, &hil::SteadyClock::stopwatch, std::move(stages.stars));
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
  scene.earthshine_sensor = earthshine_sensor(render.noise, scenario.materials);
  const auto bodies = traced_bodies(scenario);
  for (const auto& body : bodies) triangles_ += body->mesh.triangles.size();
  if (render.mesh_level == engine::MeshLevelChoice::kAuto && bodies.size() == 1)
    engine::add_mesh_levels(*bodies.front(), scenario.materials, render);
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
  return {engine::SnapshotBuilder(scene, *camera_, *target_, move_companions(scenario)),
          engine::make_renderer(render, bodies.front(), pool_, {bodies.begin() + 1, bodies.end()}),
          std::move(optics), std::move(stars)};
}

std::vector<engine::Companion> Rig::move_companions(const Scenario& scenario) {
  std::vector<engine::Companion> moving;
  for (const engine::CompanionSpec& spec : scenario.companions) {
    if (spec.orbit) {
      companions_.push_back(propagator_of(scenario, *spec.orbit));
    } else {
      companions_.push_back(std::make_unique<engine::HeldOffset>(*target_, spec.offset));
    }
    const engine::Propagator& place = *companions_.back();
    const engine::Propagator& upright = spec.orbit ? place : *target_;
    moving.push_back({place, upright, engine::BodyAttitude(spec.attitude, epoch_)});
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
