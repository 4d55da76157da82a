#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/render/body_light.h"
#include "engine/render/cap_light.h"
#include "engine/render/lamp_view.h"
#include "engine/render/recent_turns.h"
#include "engine/render/texel_rays.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// Light of one lamp that comes to the target's surface by way of other places of it, and that of
/// the Earth's sunlit cap where the sky is open to it, kept by texels as fine as the camera's
/// pixels: where surfaces stand close together BodyLight's patches are too coarse.
///
/// A texel has 64 rays (TexelRays). It is made after a frame that asked for it, 8192 a frame: the
/// others' light is BodyLight's until then. It begins
/// with eight of its rays and gets the others as frames go by, and when it has all and is wanted
/// better a further set, up to eight. Which of the places met are in the light is asked anew when
/// the lamp has turned by 8 mrad or 64 frames have passed. What goes to the camera is summed up in
/// every fourth frame if the camera has turned by 1 deg since, or 3 deg where all directions are
/// alike. Of texels that no pixel has looked at for 16 frames nothing is done. So a frame depends
/// on those before it, and on nothing else: neither on threads nor on a clock.
/// Light from other surfaces changes over a share of their distance, so what is shown is the mean
/// over the texels of the same side that are near to each other. While a texel has eight rays that
/// is .15 of the harmonic mean distance that they went (the measure of Ward, Rubinstein and Clear
/// 1988, A Ray Tracing Solution for Diffuse Interreflection); it shrinks as rays come, as in
/// Hachisuka, Ogaki and Jensen 2008, Progressive Photon Mapping, and leaves no bias.
/// How noisy a texel is is found when its places are asked anew, from how neighbouring bins differ.
/// Where there is no room for a texel all begin anew, half as wide again; so they do when pixels
/// have become that much wider or narrower.
///
/// Light leaves a place evenly, as BouncedLight has it.
/// Thread: update() the loop's, the rest any. Loop-safe but for the constructor. What it is given
/// outlives it.
class TexelLight {
 public:
  TexelLight(const TracedTarget& target, const BodyLight& body_light, int bounces);

  /// What a frame needs to know of a lamp.
  struct LampInView {
    std::size_t index = 0;
    const LampView& view;
  };
  /// Makes what was asked for since the last call, and renews what is due. `all_rays`: at once.
  /// True: look and update again, for there was no room and all begins anew with coarser texels
  /// that have to be asked for, or there is more of what all rays are asked for.
  bool update(const Snapshot& snapshot, const LampInView& lamp, double px_m, bool all_rays,
              WorkerPool& pool) noexcept;

  static constexpr std::uint32_t kNone = TexelRays::kNone;
  /// What goes to the camera.
  struct Light {
    float w_m2_sr = 0;
    float noise_w_m2_sr = 0;  ///< rms, of having few rays a bin
    float noise_of_one = 0;   ///< the same, of one set of rays
    std::uint32_t sets = 0;   ///< of rays
    float averaged = 1;       ///< so many texels' worth has the same noise
    std::uint32_t kept = kNone;
  };
  /// Not a number where nothing is kept: asked for.
  [[nodiscard]] Light at(std::uint32_t facet, unsigned side, float second, float third) noexcept {
    const std::uint32_t texel = grid_.at(facet, side, second, third);
    const std::uint32_t kept = first_of_[texel];
    if (kept != kNone) {
      const Value& value = shown_[kept];
      const std::atomic_ref looked(looked_at_[kept]);
      if (looked.load(std::memory_order_relaxed) == 0) looked.store(1, std::memory_order_relaxed);
      return {irradiance_w_m2_ * value.of_lamp + value.of_earth_w_m2_sr,
              irradiance_w_m2_ * value.noise,
              irradiance_w_m2_ * value.noise_of_one,
              value.sets,
              value.averaged,
              kept};
    }
    std::atomic_ref(asked_[texel]).store(1, std::memory_order_relaxed);
    return {std::numeric_limits<float>::quiet_NaN()};
  }
  /// For a Light with a number. What is asked of it may depend on other texels' light, but not on
  /// its own: of those that miss something bright none would look noisy, and all be too dark.
  void want_more(const Light& light) noexcept {
    std::atomic_ref(wanted_[light.kept]).store(1, std::memory_order_relaxed);
  }

  /// Of the last update().
  [[nodiscard]] RayCounts rays() const noexcept { return counts_; }
  [[nodiscard]] std::size_t size() const noexcept { return rays_.size(); }
  [[nodiscard]] float texel_m() const noexcept { return texel_m_; }

 private:
  static constexpr std::size_t kRays = TexelRays::kRays;

  /// To the camera.
  struct Value {
    float of_lamp = 0;  ///< bounced, in W/m^2/sr for 1 W/m^2
    float noise = 0;    ///< rms, of that
    float of_earth_w_m2_sr = 0;
    float noise_of_one = 0;
    std::uint32_t sets = 1;
    float rays = 0;
    float reach_m = 0;   ///< see above; of no rays it is no number
    float averaged = 1;  ///< texels
  };
  /// What says whether there is anything to do: apart, for it is looked at in each frame.
  struct State {
    std::uint32_t lit_in = 0;        ///< frame
    std::uint32_t summed_in = 0;     ///< frame
    std::uint32_t looked_at_in = 0;  ///< frame; of its texel's first set
    std::uint32_t first = kNone;     ///< of its texel's sets
    std::uint32_t next = kNone;      ///< a further one
    bool even = false;               ///< BinnedBrdf::even()
    bool back = false;               ///< of the first: looked at again, after a while
    bool summed = false;             ///< in this frame
  };
  /// How the last side that a thread was at reflects to the camera.
  struct Reflection {
    std::uint32_t side = kNone;
    bool facing = false;
    bool sees_earth = false;
    HemisphereBins::FineValues weights{};
    HemisphereBins::Values earth_w_m2_sr{};  ///< what each bin sends on of it
  };

  void start_over(float texel_m) noexcept;
  [[nodiscard]] bool make_asked(bool all) noexcept;
  void make_wanted() noexcept;
  void keep(const TexelGrid::Texel& texel, std::uint32_t number, std::uint32_t first) noexcept;
  void choose_due() noexcept;
  void note_looks(std::size_t first, std::size_t end) noexcept;
  /// Of a texel's first set.
  [[nodiscard]] bool awake(std::size_t first) const noexcept;
  void combine(std::size_t first, std::size_t end) noexcept;
  void smooth(std::size_t first, std::size_t end, bool all) noexcept;
  void light_sides(const Snapshot& snapshot, std::size_t lamp, WorkerPool& pool) noexcept;
  void tend(std::size_t first, std::size_t end, const Snapshot& snapshot, const LampInView& lamp,
            bool all_rays) noexcept;
  void renew(std::size_t k, bool changed, const Snapshot& snapshot, const LampInView& lamp,
             Reflection& reflection) noexcept;
  void weigh(const TexelGrid::Texel& texel, const Snapshot& snapshot,
             Reflection& reflection) const noexcept;
  void reflect_earth(const EarthLight& earth, const Eigen::Vector3f& normal,
                     Reflection& reflection) const noexcept;
  [[nodiscard]] float of_lamp(std::size_t k, const Reflection& reflection) const noexcept;
  [[nodiscard]] float of_earth(std::size_t k, const Reflection& reflection) const noexcept;
  [[nodiscard]] float noise(std::size_t k, const Reflection& reflection) const noexcept;
  [[nodiscard]] float arriving(std::size_t k, std::size_t bin) const noexcept;

  const TracedTarget& target_;
  const BodyLight& body_light_;
  bool further_;
  TexelGrid grid_;
  float texel_m_ = 0;
  float least_m_ = 0;  ///< there is no room for finer texels
  TexelRays rays_;
  std::vector<std::uint32_t> first_of_;  ///< set of rays, by texel
  std::vector<std::uint8_t> asked_;      ///< by texel
  std::vector<State> states_;            ///< by set
  std::vector<Value> own_;               ///< by set, of its rays alone
  std::vector<Value> values_;            ///< of all sets, where it is the first
  std::vector<Value> shown_;             ///< the same, smoothed
  std::vector<std::uint8_t> wanted_;     ///< by set, as asked_
  std::vector<float> sent_;              ///< by 2 * facet + side, for 1 W/m^2
  std::vector<std::uint8_t> looked_at_;  ///< by set, since the last update()
  RecentTurns lamp_turns_;
  RecentTurns camera_turns_;       ///< that show in a lobe
  RecentTurns camera_even_turns_;  ///< that show elsewhere
  CapLight cap_;
  std::size_t refine_from_ = 0;
  std::uint32_t frame_ = 0;
  std::size_t lamp_ = 0;
  float irradiance_w_m2_ = 0;
  RayCounts counts_;
};

}  // namespace engine
