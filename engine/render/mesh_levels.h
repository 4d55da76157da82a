#pragma once

#include <memory>
#include <vector>

#include "engine/render/render_spec.h"
#include "engine/render/traced_target.h"

namespace engine {

/// Makes coarser forms of a target with a fine mesh, and keeps them with it: those that the sensor
/// cannot tell from it at some distance from which the target is resolved. A mesh of fewer than
/// 20 000 triangles has none, nor a sensor that is not known.
/// May throw std::bad_alloc. Takes seconds for a mesh of 200 000 triangles.
void add_mesh_levels(TracedTarget& target, const std::vector<Material>& materials,
                     const RenderSpec& spec);

/// Draws a target with the coarsest of its meshes that the sensor cannot tell from the finest.
///
/// A surface that is off by e pixels moves edges by as much and turns what lies between by e a
/// pixel: either changes a pixel by about e times its light. So the error is
/// e * light / sigma(light), light that of the brightest diffuse surface in the frame's lamps; at
/// most a share of what the profile allows all model errors together. Half as much again is put on
/// top: measured over lit pixels it is 1.1 to 1.7 times that error, the more the fewer triangles
/// have gone.
/// Where a glint shows of what the coarser mesh has smoothed, the finest is taken.
/// Once a finer mesh has been taken a coarser one is not until the range has grown by a tenth, so
/// that an approach takes each once. Each has a renderer of its own, with what that keeps on the
/// body; all are made beforehand.
/// Leaves out: specular light in that error; companions, with which the finest is taken.
/// Thread: loop. Loop-safe but for the constructor.
class LevelledRenderer final : public Renderer {
 public:
  static constexpr double kOnTop = 1.5;

  /// `renderers`: of the target, and of each of its coarser forms.
  LevelledRenderer(const RenderSpec& spec, const TracedTarget& target,
                   std::vector<std::unique_ptr<Renderer>> renderers);

  RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept override;

 private:
  struct Level {
    std::unique_ptr<Renderer> renderer;
    double rms_m = 0;
    std::vector<CoarserTarget::Gloss> gloss;
  };
  [[nodiscard]] std::size_t choose(const Snapshot& snapshot, double light_e) noexcept;
  [[nodiscard]] double off_px(const Level& level, const Snapshot& snapshot) const noexcept;

  RenderSpec spec_;
  double brightest_;           ///< diffuse light of the target, per steradian, of 1 W/m^2
  std::vector<Level> levels_;  ///< finest first
  // Of the frames before.
  std::size_t level_ = 0;
  bool any_ = false;
  double refined_at_m_ = 0;  ///< range
};

}  // namespace engine
