#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/imaging_chain.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/visibility.h"
#include "engine/render/path_tracer.h"
#include "engine/scene/brdf.h"
#include "hil/closed_loop_pointing.h"
#include "hil/frame_loop.h"
#include "tools/tracker/tracker.h"

namespace starloop {

enum class ClockMode : std::uint8_t { kRealtime, kLockstep };
/// How frames are kept.
enum class RecordFrames : std::uint8_t { kNone, kPng, kFits, kCube, kRaw };

/// How a run goes: when, how fast, what is kept.
struct RunSpec {
  std::size_t pass = 1;    ///< counted from 1
  std::string pass_where;  ///< the place in the scenario that says so
  double duration_s = 0;   ///< 0: the whole pass
  engine::Duration exposure{};
  engine::Duration period{};
  engine::Duration command_lead{};
  engine::Duration answer_timeout{};
  ClockMode clock = ClockMode::kRealtime;
  std::uint64_t record_every = 10;
  RecordFrames record_frames = RecordFrames::kPng;
  engine::Duration sync_every{};  ///< of the logs: what a power cut may cost
};

struct Criteria {
  double pointing_rms_px = 0;  ///< 0: none
  double after_s = 0;
};

/// All Specs of a run, as the rooms have read and checked them.
struct Scenario {
  std::string name;
  RunSpec run;
  Criteria criteria;
  engine::KeplerElements camera_orbit;
  engine::KeplerElements target_orbit;
  engine::VisibilitySpec visibility;
  engine::Duration search_span{};
  engine::SceneSpec scene;
  std::string mesh;
  std::string mesh_where;  ///< the place in the scenario that names it
  std::vector<engine::Material> materials;
  engine::RenderSpec render;
  engine::OpticsSpec optics;
  engine::DetectorSpec detector;
  hil::GuidanceError guidance;
  hil::RollRule roll = hil::RollRule::kCelestial;
  hil::ActuatorSpec actuator;
  tracker::TrackerSpec tracker;
};

/// What the command line says about every subcommand.
struct CommonOptions {
  std::string file;
  std::vector<std::string> overrides;  ///< table.key=value
  int threads = 0;                     ///< 0: one for each processor
  bool quiet = false;
  bool seed_given = false;
  std::uint64_t seed = 0;
};

/// What a scenario is read from: enough to read it again without the file.
struct ScenarioSource {
  std::string file;  ///< for complaints
  std::string text;
  std::vector<std::string> overrides;  ///< with --seed among them
};

/// All throw engine::ConfigError.
[[nodiscard]] ScenarioSource read_source(const CommonOptions& options);
[[nodiscard]] Scenario load_scenario(const ScenarioSource& source);
[[nodiscard]] Scenario load_scenario(const CommonOptions& options);
[[nodiscard]] Scenario read_scenario(const engine::ConfigReader& config);

/// Everything that is built from a scenario once, before the first shutter opens.
class Rig {
 public:
  Rig(const Scenario& scenario, int threads);

  [[nodiscard]] engine::ImagingChain& chain() noexcept { return *chain_; }
  [[nodiscard]] hil::ScriptedPointing prediction() const;
  /// The camera that obeys, in a run that begins at `start`.
  [[nodiscard]] hil::ClosedLoopPointing pointing(engine::SimTime start) const;
  [[nodiscard]] const engine::KeplerPropagator& camera() const noexcept { return camera_; }
  [[nodiscard]] const engine::KeplerPropagator& target() const noexcept { return target_; }
  [[nodiscard]] int threads() const noexcept { return pool_.threads(); }
  [[nodiscard]] std::size_t triangles() const noexcept { return triangles_; }

 private:
  engine::Epoch epoch_;
  engine::LightPath path_;
  hil::RollRule roll_;
  hil::GuidanceError guidance_;
  hil::ActuatorSpec actuator_;
  engine::KeplerPropagator camera_;
  engine::KeplerPropagator target_;
  engine::WorkerPool pool_;
  std::size_t triangles_ = 0;
  std::unique_ptr<engine::ImagingChain> chain_;
};

[[nodiscard]] std::vector<engine::Pass> passes_of(const Scenario& scenario);

}  // namespace starloop
