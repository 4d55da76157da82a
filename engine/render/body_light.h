#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/hemisphere_bins.h"
#include "engine/render/surface_patches.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// Light that comes to the target's surface by way of other places of it, kept on the body by
/// patch and direction: it is smooth, a few per cent of all light, and changes over seconds.
///
/// What bounces leaves a patch evenly, with the albedo of the direction that it came from, as
/// BouncedLight has it; towards the camera a patch reflects it by its BRDF.
/// Lamps are taken from the nearest of directions 8 mrad apart, and asked anew when that is another
/// one. The Earth's cap, where the view has it, shines on patches from where the sky is open.
/// Leaves out what took more than `bounces` bounces, and changes finer than a patch: those are
/// TexelLight's.
/// Thread: loop. Loop-safe but for the constructor. The target outlives it.
class BodyLight {
 public:
  BodyLight(const TracedTarget& target, int bounces, WorkerPool& pool);

  /// For the snapshot's lamps and camera.
  void light_up(const Snapshot& snapshot, WorkerPool& pool) noexcept;

  /// What each patch sends to the camera of a lamp's light, in W/m^2/sr, but for what it mirrors;
  /// nothing of a lamp that is off.
  [[nodiscard]] std::span<const float> to_camera(std::size_t lamp) const noexcept {
    return to_camera_[lamp];
  }
  /// Of the light that it mirrors, the share that it sends to the camera; 0 for most materials.
  [[nodiscard]] float mirror_share(std::uint32_t material, float cos_out) const noexcept {
    return binned_[material].mirror_share(cos_out);
  }
  /// What a mirror sees there: all that leaves the place's patch, lamps' light too, in W/m^2/sr; 0
  /// where nothing is known.
  [[nodiscard]] float leaving(const SurfacePoint& place) const noexcept {
    const std::uint32_t patch = patches_.at(place);
    return patch == SurfacePatches::kNone ? 0.0F : leaving_[patch];
  }
  /// What leaves a patch of light that has bounced before, for 1 W/m^2 of a lamp.
  [[nodiscard]] float further(std::size_t lamp, std::uint32_t patch) const noexcept {
    return patch < SurfacePatches::kSky ? lamps_[lamp].bounced[patch] : 0.0F;
  }
  [[nodiscard]] const BinnedBrdf& binned(std::uint32_t material) const noexcept {
    return binned_[material];
  }
  [[nodiscard]] const SurfacePatches& patches() const noexcept { return patches_; }

 private:
  /// What a lamp of 1 W/m^2 does.
  struct Kept {
    Eigen::Vector3f toward = Eigen::Vector3f::Zero();  ///< zero: nothing kept
    std::vector<float> lit_share;
    std::vector<float> leaving;
    std::vector<float> bounced;                    ///< of what leaves, what has bounced before
    std::vector<HemisphereBins::Values> arriving;  ///< radiance by bin, in the patch's axes
  };
  template <class Work>
  void each_patch(WorkerPool& pool, const Work& work) const noexcept;
  /// `cap`: in place of the lamp, if not dark.
  void renew(Kept& kept, const Lamp& lamp, const EarthLight& cap, WorkerPool& pool) noexcept;
  [[nodiscard]] float sent_on(std::size_t patch, const EarthLight& cap) const noexcept;
  void ask(Kept& kept, std::size_t first, std::size_t end) const noexcept;
  void gather(std::size_t patch, HemisphereBins::Values& arriving) const noexcept;

  const TracedTarget& target_;
  int bounces_;
  SurfacePatches patches_;
  std::vector<BinnedBrdf> binned_;  ///< by material
  std::array<Kept, kLamps> lamps_;
  std::vector<float> sent_;  ///< by patch, of one bounce
  std::vector<float> next_;
  std::array<std::vector<float>, kLamps> to_camera_;
  std::vector<float> leaving_;
};

}  // namespace engine
