#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/render/light_parts.h"
#include "engine/render/path_tracer.h"

namespace engine {

/// The light that the target sends towards a camera so far away that lines of sight are parallel,
/// as a picture in metres: kept, for it changes slowly.
///
/// The picture is the path tracer's, at 128 by 128 px from a million radii away with a number of
/// samples that the scenario's own samples set: a function of the directions and lamps alone. At 16
/// a pixel its light is good to some 3e-3, a resolved target's of 24 px at 50 to 1e-2.
/// It is made anew when light may have changed by more than the caller allows: by the change that
/// the last two pictures showed for so much of a turn, or half of what was expected before, at
/// first the flank of the narrowest lobe; and whenever a direction has moved by a third of that
/// lobe's half width. Thread: loop. Loop-safe but for the constructor.
class FarLight {
 public:
  static constexpr int kSide_px = 128;

  /// A square of the picture.
  struct Cell {
    float x_m = 0;  ///< of its middle, from the body's origin
    float y_m = 0;
    float light_w_sr = 0;
    float area_m2 = 0;  ///< that the target covers
  };

  FarLight(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool);

  /// For the snapshot's lamps and line of sight. `change`: of the light, as a share of it.
  void update(const Snapshot& snapshot, double change) noexcept;

  [[nodiscard]] double intensity_w_sr() const noexcept { return parts_.light(); }
  [[nodiscard]] double area_m2() const noexcept { return area_m2_; }
  /// In metres and W/sr.
  [[nodiscard]] const LightParts& parts() const noexcept { return parts_; }
  /// Those with anything in them.
  [[nodiscard]] std::span<const Cell> cells() const noexcept { return cells_; }
  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  /// Of the picture, in the body frame; the camera's own as it was then.
  [[nodiscard]] const Eigen::Vector3d& x_axis() const noexcept { return kept_.x_axis; }
  [[nodiscard]] const Eigen::Vector3d& y_axis() const noexcept { return kept_.y_axis; }
  /// Of the picture in hand. `rays` and their like: what this frame spent, 0 when it kept it.
  [[nodiscard]] const RenderReport& report() const noexcept { return report_; }

 private:
  /// What the picture is a function of.
  struct Kept {
    bool any = false;
    Eigen::Vector3d toward_camera = Eigen::Vector3d::UnitZ();
    Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX();
    Eigen::Vector3d y_axis = Eigen::Vector3d::UnitY();
    Lamp sun;
    Lamp earthshine;
    [[nodiscard]] double irradiance_w_m2() const noexcept {
      return sun.irradiance_w_m2 + earthshine.irradiance_w_m2;
    }
  };
  /// By what light may have changed between the two.
  struct Moved {
    double angle_rad = 0;    ///< of the directions, each lamp's by its share of the light
    double largest_rad = 0;  ///< of one
    double turn_rad = 0;     ///< of the picture's axes
    double lamps = 0;        ///< share that lamps changed by
    [[nodiscard]] static Moved between(const Kept& a, const Kept& b) noexcept;
  };
  [[nodiscard]] static Kept seen_in(const Snapshot& snapshot) noexcept;
  void renew(const Snapshot& snapshot) noexcept;
  void take_cells() noexcept;

  double far_m_;
  double cell_m_;
  double narrowest_rad_;  ///< half width of a lobe; of those without one, half a radian
  PathTracer paths_;
  Kept kept_;
  double change_per_rad_;
  bool knows_change_ = false;  ///< from pictures
  Radiance picture_;
  std::vector<Cell> cells_;
  std::vector<LightSpot> spots_;
  LightParts parts_;
  double area_m2_ = 0;
  RenderReport report_;
};

}  // namespace engine
