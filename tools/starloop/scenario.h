#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/open_link.h"
#include "engine/imaging_chain.h"
#include "engine/orbit/orbit_spec.h"
#include "engine/orbit/passes.h"
#include "engine/orbit/visibility.h"
#include "engine/render/render_spec.h"
#include "engine/scene/material.h"
#include "hil/closed_loop_pointing.h"
#include "hil/command_port.h"
#include "hil/faults/fault_spec.h"
#include "hil/frame_loop.h"
#include "hil/realtime.h"
#include "hil/score.h"
#include "tools/tracker/tracker.h"

namespace starloop {

enum class ClockMode : std::uint8_t {
  kRealtime,          ///< absolute deadlines on the monotonic clock
  kLockstep,          ///< each frame waits for the answer to the last
  kAsFastAsPossible,  ///< each frame waits for the link alone
  kTriggered,         ///< each frame waits for a pull from outside
};

/// How frames are kept.
enum class RecordFrames : std::uint8_t { kNone, kPng, kFits, kCube, kRaw };

/// How a run goes: when, how fast, what is kept.
struct RunSpec {
  std::size_t pass = 1;    ///< counted from 1
  std::string pass_where;  ///< the place in the scenario that says so
  double duration_s = 0;   ///< 0: the whole pass
  bool pattern = false;    ///< a test pattern instead of the scene
  engine::Duration exposure{};
  engine::Duration period{};
  engine::Duration command_lead{};
  engine::Duration render_time{};  ///< of a frame, at most; zero: as long as it takes
  bool sheds = false;              ///< frames that take too long make the next leave something out
  engine::Duration answer_timeout{};
  ClockMode clock = ClockMode::kRealtime;
  std::string trigger;        ///< "packet", "stdin", or the path of a pipe: a line is a pull
  std::string trigger_where;  ///< the place in the scenario that says so
  engine::Duration trigger_timeout{};
  engine::Duration start_timeout{};  ///< how long the start waits for the software under test
  std::uint64_t record_every = 10;
  RecordFrames record_frames = RecordFrames::kPng;
  bool record_quality = true;     ///< how good a picture each frame is
  engine::Duration sync_every{};  ///< of the logs: what a power cut may cost
};

struct Criteria {
  double pointing_rms_px = 0;  ///< 0: none
  double after_s = 0;
  hil::DetectionCriteria detection;
};

/// All Specs of a run, as the rooms have read and checked them.
struct Scenario {
  std::string name;
  RunSpec run;
  Criteria criteria;
  engine::OrbitSpec camera_orbit;
  engine::OrbitSpec target_orbit;
  engine::VisibilitySpec visibility;
  engine::Duration search_span{};
  engine::SimTime latest{};  ///< of all times, where frames after the search are wanted
  engine::SceneSpec scene;
  engine::MeshSpec mesh;
  std::vector<engine::CompanionSpec> companions;
  std::vector<engine::PartSpec> parts;
  std::optional<engine::SimTime> parts_frozen_at;  ///< they stay as they stand then
  std::vector<engine::Material> materials;
  engine::RenderSpec render;
  engine::OpticsSpec optics;
  engine::StarSpec stars;
  engine::DetectorSpec detector;
  hil::GuidanceError guidance;
  hil::GuidanceMode mode = hil::GuidanceMode::kPredictedTarget;
  hil::TargetKnowledge target_knowledge;
  hil::RollRule roll = hil::RollRule::kCelestial;
  std::optional<engine::CameraAttitude> boresight;  ///< in the sky, instead of the target
  hil::ActuatorSpec actuator;
  hil::RealtimeSpec realtime;
  drivers::LinkSpec link;
  std::optional<hil::CommandPortSpec> port;
  hil::FaultSpec faults;
  hil::JitterSpec jitter;
  hil::JitterSpec slow_vibration;  ///< of the optics, of few periods to an exposure: in jitter, too
  hil::SensorSpec sensors;
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
/// In the order that frames have them in.
[[nodiscard]] std::vector<std::string> companion_names(const Scenario& scenario);
/// The same of parts: the target's by their own name, a companion's as <companion>.<part>.
[[nodiscard]] std::vector<std::string> part_names(const Scenario& scenario);

/// Of what the camera reads out. Throws engine::ConfigError.
[[nodiscard]] engine::SensorMaps sensor_maps(const Scenario& scenario);

/// Makes sure that all orbits have an answer when frames are taken by shutters that open in
/// between, light's way and guidance that aims ahead included. Throws engine::ConfigError.
void want_frames(Scenario& scenario, engine::SimTime first, engine::SimTime last);
/// A body of the scenario as it moves, from the epoch to the last time that matters.
[[nodiscard]] std::unique_ptr<const engine::Propagator> propagator_of(
    const Scenario& scenario, const engine::OrbitSpec& orbit);

[[nodiscard]] std::vector<engine::Pass> passes_of(const Scenario& scenario);
/// The one that the scenario's run is about. Throws engine::ConfigError when there is no such.
[[nodiscard]] engine::Pass chosen_pass(const Scenario& scenario);

}  // namespace starloop
