#pragma once

#include <array>
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
/// samples that the scenario's own samples set: a function of the directions and lamps alone. It
/// comes in kBatches batches, one a frame, each of which goes on with the sequence of those before:
/// no frame costs more than one. With 16 samples a pixel a batch, the default, the first leaves
/// some 4e-3 of noise in the light of a telescope and all eight under 1e-3.
/// The next is begun when light may have changed by half of what the caller allows, and shown when
/// it is whole or the one before is past all of that, so that a slow approach sees whole pictures
/// alone; a jump is shown with a single batch. The change is what the last two pictures showed for
/// so much of a turn, or half of what was expected before, at first the flank of the narrowest
/// lobe; and a direction may not move by more than a third of that lobe's half width. The Earth's
/// cap counts by where it is and what part of it is lit.
/// Thread: loop. Loop-safe but for the constructor.
class FarLight {
 public:
  static constexpr int kSide_px = 128;
  static constexpr int kBatches = 8;

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

  /// Another renderer has lit the target's facets: a picture that is not whole is begun anew.
  void interrupt() noexcept { facets_are_ours_ = false; }

  [[nodiscard]] double intensity_w_sr() const noexcept { return parts_.light(); }
  [[nodiscard]] double area_m2() const noexcept { return area_m2_; }
  /// In metres and W/sr.
  [[nodiscard]] const LightParts& parts() const noexcept { return parts_; }
  /// Those with anything in them.
  [[nodiscard]] std::span<const Cell> cells() const noexcept { return cells_; }
  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  /// Of the picture, in the body frame; the camera's own as it was then.
  [[nodiscard]] const Eigen::Vector3d& x_axis() const noexcept { return shown().kept.x_axis; }
  [[nodiscard]] const Eigen::Vector3d& y_axis() const noexcept { return shown().kept.y_axis; }
  /// How many have been shown, and of how many batches the one in hand is.
  [[nodiscard]] int pictures() const noexcept { return pictures_shown_; }
  [[nodiscard]] int batches() const noexcept { return shown().batches; }
  /// Of its light, rms, as the batches of the last whole picture differed; not a number: none yet.
  [[nodiscard]] double noise_share() const noexcept;
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
    Eigen::Vector3d earths_centre = Eigen::Vector3d::Zero();  ///< of the cap, where there is one
    Eigen::Vector3d earths_sun = Eigen::Vector3d::Zero();
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
  struct Picture {
    Kept kept;
    Snapshot from_far;
    Radiance light;
    int batches = 0;
  };
  [[nodiscard]] const Picture& shown() const noexcept { return pictures_[shown_]; }
  [[nodiscard]] static Kept seen_in(const Snapshot& snapshot) noexcept;
  [[nodiscard]] bool beyond(const Kept& a, const Kept& b, double change,
                            double part) const noexcept;
  void begin(const Snapshot& snapshot, const Kept& seen) noexcept;
  void add_batch() noexcept;
  void note_batch(double mean) noexcept;
  void show() noexcept;  ///< into cells_ and parts_
  void learn_change(const Kept& before, double intensity_before) noexcept;

  double far_m_;
  double cell_m_;
  double narrowest_rad_;  ///< half width of a lobe; of those without one, half a radian
  int samples_;           ///< a batch
  int batches_at_once_;
  PathTracer paths_;
  std::array<Picture, 2> pictures_;
  std::size_t shown_ = 0;
  std::size_t making_ = 0;  ///< has the path tracer's own part of a picture
  bool facets_are_ours_ = false;
  int pictures_shown_ = 0;
  // Of the batches of the picture in the making, their light.
  double sum_ = 0;
  double sum2_ = 0;
  double last_mean_ = 0;
  double batch_noise_;  ///< as a share
  double change_per_rad_;
  bool knows_change_ = false;  ///< from pictures
  std::vector<Cell> cells_;
  std::vector<LightSpot> spots_;
  LightParts parts_;
  double area_m2_ = 0;
  RenderReport report_;
};

}  // namespace engine
