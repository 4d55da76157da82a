#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/worker_pool.h"
#include "engine/render/other_bodies.h"
#include "engine/render/renderer.h"
#include "engine/render/sobol.h"
#include "engine/scene/brdf.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

struct TracedTarget;

enum class RenderMethod : std::uint8_t {
  kLattice,  ///< LatticeRenderer: coverage from a lattice of points, light kept on the body
  kPaths     ///< PathTracer: the reference
};

/// Whether the Sun is its disc or a point.
enum class SunDisc : std::uint8_t {
  kAuto,  ///< glints always, shadows where their edges are wide enough to show
  kOn,
  kOff
};

/// How a target is drawn that is small on the detector: FarTarget.
enum class FarTargetForm : std::uint8_t {
  kAuto,      ///< by its size and the sensor's noise
  kResolved,  ///< as any other
  kPoint      ///< a point, whatever its size
};

/// Which mesh a fine target is drawn with: LevelledRenderer.
enum class MeshLevelChoice : std::uint8_t {
  kFull,
  kAuto  ///< by its size and the sensor's noise
};

/// What errors a frame may have, as shares of the sensor's noise.
struct RenderProfile {
  double rho_total = 0.3;  ///< of all model errors together
  double rho_mc = 0.19;    ///< of Monte Carlo noise after the optics, rms over lit pixels
};

struct RenderSpec {
  RenderMethod method = RenderMethod::kPaths;
  bool method_by_need = false;  ///< kLattice, unless the scenario has what it does not know
  int lattice_side = 0;         ///< lattice: points on a side of a cell: 2, 4 or 8; 0: 4, more for
                                ///< targets that are small on the detector and fewer for large ones
  /// Lattice: what is kept on the body is complete in each frame, whatever that takes.
  bool settled = false;
  RenderProfile profile;
  int samples_per_pixel = 50;    ///< paths: shared by the cells of a pixel, rounded up; 0: as the
                                 ///< profile asks
  double bounce_share = 0.15;    ///< paths: in (0, 1]: of the samples that follow the first bounce
  int bounces = 1;               ///< indirect bounces; 0 leaves direct light alone
  bool bounces_by_need = false;  ///< `bounces` is chosen when the renderer is made
  /// What further bounces would add to a pixel, at most; not a number: not known.
  double bounces_left_out_e = std::numeric_limits<double>::quiet_NaN();
  BrdfSampler sampler = BrdfSampler::kMixture;   ///< paths: of bounces
  SequenceKind sequence = SequenceKind::kSobol;  ///< paths
  bool exact_caustics = false;                   ///< paths
  SunDisc sun_disc = SunDisc::kAuto;
  FarTargetForm far_target = FarTargetForm::kAuto;
  MeshLevelChoice mesh_level = MeshLevelChoice::kFull;
  static constexpr int kMostOfLattice = 4;  ///< cells on a pixel's side that the lattice can do
  CameraGeometry camera;
  GridWish grid;
  SensorNoise noise;
  Duration (*clock)() noexcept = nullptr;  ///< for Budget::time; none: no deadline
};
[[nodiscard]] RenderSpec read_render(const ConfigTable& table);

/// The renderer that the spec asks for; a target with coarser meshes is drawn with them, but for
/// one with other bodies. May throw. Pre: with those the method is kPaths.
[[nodiscard]] std::unique_ptr<Renderer> make_renderer(const RenderSpec& spec,
                                                      std::shared_ptr<TracedTarget> target,
                                                      WorkerPool& pool,
                                                      const OtherBodies& others = {});

}  // namespace engine
