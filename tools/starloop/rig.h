#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hil/closed_loop_pointing.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// How many a number on the command line means; 0: one for each processor.
[[nodiscard]] int worker_threads(int wanted);
/// Light on the detector that is lost in the noise of a dark pixel: how far the optics follow
/// wings.
[[nodiscard]] double faint_irradiance_w_m2(const Scenario& scenario);

/// Everything that is built from a scenario once, before the first shutter opens.
class Rig {
 public:
  Rig(const Scenario& scenario, int threads);

  /// What its generator is made of, but the detector.
  struct Stages {
    engine::SnapshotBuilder scene;
    std::unique_ptr<engine::Renderer> renderer;
    engine::Optics optics;
    std::unique_ptr<engine::Starlight> stars;  ///< none: a sky without stars
  };
  /// For who looks between them, once. The rig outlives them.
  [[nodiscard]] Stages make_stages(const Scenario& scenario);
  /// The whole of it, for who looks at the light behind a frame. The rig outlives it.
  [[nodiscard]] engine::ImagingChain make_chain(const Scenario& scenario);
  [[nodiscard]] engine::WorkerPool& pool() noexcept { return pool_; }

  [[nodiscard]] engine::SceneGenerator& generator() noexcept { return *generator_; }
  /// Without an error.
  [[nodiscard]] hil::ScriptedPointing prediction() const;
  /// Whose shutter opens then, the camera following that; of vibration with the optics' slow one.
  [[nodiscard]] engine::Shot predicted_shot(engine::SimTime open, engine::Duration exposure) const;
  /// As far as the target's orbit is known.
  [[nodiscard]] hil::ScriptedPointing believed() const;
  [[nodiscard]] const engine::Propagator& camera() const noexcept { return *camera_; }
  [[nodiscard]] const engine::Propagator& target() const noexcept { return *target_; }
  [[nodiscard]] int threads() const noexcept { return pool_.threads(); }
  /// Of the target and all companions.
  [[nodiscard]] std::size_t triangles() const noexcept { return triangles_; }
  /// A line about the catalogue of stars; empty when there is none.
  [[nodiscard]] const std::string& star_text() const noexcept { return star_text_; }
  /// A line for each material that a user should know something about.
  [[nodiscard]] const std::vector<std::string>& material_notes() const noexcept {
    return material_notes_;
  }

 private:
  [[nodiscard]] std::vector<engine::Companion> move_companions(const Scenario& scenario);

  engine::Epoch epoch_;
  engine::LightPath path_;
  hil::RollRule roll_;
  std::optional<engine::CameraAttitude> boresight_;
  hil::Jitter slow_vibration_;
  std::unique_ptr<const engine::Propagator> camera_;
  std::unique_ptr<const engine::Propagator> target_;
  std::vector<std::unique_ptr<const engine::Propagator>> companions_;
  hil::BelievedTarget believed_target_;
  engine::WorkerPool pool_;
  std::size_t triangles_ = 0;
  std::string star_text_;
  std::vector<std::string> material_notes_;
  std::unique_ptr<engine::SceneGenerator> generator_;
};

/// Frames that nobody gets, as of the first one's time: in real time what a renderer keeps on the
/// body would else be begun when the first shutter opens, and the next ones be skipped for it. A
/// replay has them too, for the frames after depend on them.
void run_up(const Scenario& scenario, Rig& rig, engine::SimTime start);

/// The camera that obeys, in a run that starts at `start`. The rig outlives it.
[[nodiscard]] hil::ClosedLoopPointing make_pointing(const Scenario& scenario, const Rig& rig,
                                                    engine::SimTime start);

}  // namespace starloop
