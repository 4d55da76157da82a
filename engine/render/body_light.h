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
/// Lamps are taken from the nearest of directions 8 mrad apart. When that is another one, what a
/// lamp does is worked out anew, a share in each of 32 frames; what was known is shown until then,
/// unless it is off by 50 mrad and there is time. What goes to the camera is summed up anew when it
/// has turned by 1 deg. So a frame depends on those before it, and on nothing else. The Earth's
/// cap, where the view has it, shines on patches from where the sky is open. Leaves out what took
/// more than `bounces` bounces, and changes finer than a patch: those are TexelLight's. Thread:
/// loop. Loop-safe but for the constructor. The target outlives it.
class BodyLight {
 public:
  BodyLight(const TracedTarget& target, int bounces, WorkerPool& pool);

  /// How a lamp that has turned is worked out. The first frame of a lamp has all.
  enum class Renewal : std::uint8_t {
    kAtOnce,    ///< in this frame
    kAsNeeded,  ///< in shares, and at once where what is shown is off by too much
    kInShares   ///< whatever is shown: there is no time for more
  };
  /// For the snapshot's lamps and camera.
  void light_up(const Snapshot& snapshot, Renewal renewal, WorkerPool& pool) noexcept;

  /// What a patch sends to the camera of a lamp's light, in W/m^2/sr, but for what it mirrors;
  /// nothing of a lamp that is off.
  [[nodiscard]] float to_camera(std::size_t lamp, std::uint32_t patch) const noexcept {
    return irradiance_w_m2_[lamp] * to_camera_[lamp][patch];
  }
  /// Of the light that it mirrors, the share that it sends to the camera; 0 for most materials.
  [[nodiscard]] float mirror_share(std::uint32_t material, float cos_out) const noexcept {
    return binned_[material].mirror_share(cos_out);
  }
  /// What a mirror sees there: all that leaves the place's patch, lamps' light too, in W/m^2/sr; 0
  /// where nothing is known.
  [[nodiscard]] float leaving(const SurfacePoint& place) const noexcept {
    const std::uint32_t patch = patches_.at(place);
    if (patch == SurfacePatches::kNone) return 0.0F;
    float light = 0.0F;
    for (std::size_t k = 0; k < kLamps; ++k)
      if (irradiance_w_m2_[k] > 0.0F) light += irradiance_w_m2_[k] * lamps_[k].leaving[patch];
    return light;
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
  /// A lamp's Kept while it is worked out, `done` of it patch by patch: first what each sends of
  /// the lamp's own light, then what comes of that by each bounce.
  struct Making {
    Kept kept;
    std::vector<float> sent;  ///< by patch, of the bounce before
    std::vector<float> next;
    std::size_t done = 0;
    bool begun = false;
  };
  [[nodiscard]] std::size_t work_of_all() const noexcept {
    return patches_.size() * static_cast<std::size_t>(1 + bounces_);
  }
  template <class Work>
  void each_patch(std::size_t first, std::size_t end, WorkerPool& pool,
                  const Work& work) const noexcept;
  /// True: there is a new Kept. `cap`: in place of the lamp, if not dark.
  bool renew(std::size_t lamp, const Lamp& light, const EarthLight& cap, Renewal renewal,
             WorkerPool& pool) noexcept;
  void begin_with(Making& making, std::size_t first, std::size_t end, const Lamp& light,
                  const EarthLight& cap, WorkerPool& pool) const noexcept;
  void bounce(Making& making, std::size_t first, std::size_t end, bool last,
              WorkerPool& pool) const noexcept;
  [[nodiscard]] float sent_on(std::size_t patch, const EarthLight& cap) const noexcept;
  void ask(Kept& kept, std::size_t first, std::size_t end) const noexcept;
  void gather(const std::vector<float>& sent, std::size_t patch,
              HemisphereBins::Values& arriving) const noexcept;
  void send_to_camera(std::size_t lamp, WorkerPool& pool) noexcept;

  const TracedTarget& target_;
  int bounces_;
  SurfacePatches patches_;
  std::vector<BinnedBrdf> binned_;  ///< by material
  std::array<Kept, kLamps> lamps_;
  std::array<Making, kLamps> making_;
  std::array<float, kLamps> irradiance_w_m2_{};
  Eigen::Vector3d camera_m_ = Eigen::Vector3d::Zero();  ///< that to_camera_ is for
  std::array<std::vector<float>, kLamps> to_camera_;    ///< for 1 W/m^2
  std::array<bool, kLamps> current_{};                  ///< these are for that place
};

}  // namespace engine
