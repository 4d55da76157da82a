#pragma once

#include "engine/core/random.h"
#include "engine/render/lamp_cone.h"
#include "engine/render/renderer.h"
#include "engine/render/sobol.h"
#include "engine/render/traced_target.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// How light is followed from place to place.
struct BounceRules {
  int bounces = 1;
  BrdfSampler sampler = BrdfSampler::kMixture;
  bool exact_caustics = false;  ///< a lamp's light leaves where it struck by the BRDF, not evenly
};

/// Light of the lamps that reached a place by way of other places of the target, eq 12 of Li et al.
/// 2023: a path, its directions drawn from the BRDF, a lamp asked for at each place it meets.
///
/// We differ from the print: directions are drawn from a mixture that finds every direction light
/// can come from; the 15 deg cone of eq 13-14 loses 43-99 % of it. Light that bounces is taken to
/// leave the surface where the lamp struck it evenly, with the albedo of its direction: the energy
/// is kept, caustics are spread out. Followed exactly they are found by one sample in thousands,
/// and those few move the photocentre of a frame by a pixel. With `exact_caustics` they are
/// followed, and a lamp with a disc is found both by asking for it and by running into it, weighed
/// by the balance heuristic (Veach 1997, section 9.2.2). So is the Earth's sunlit cap, where
/// LampCones have it, and already at what the camera sees: paths may go one step beyond the last
/// bounce to run into it. Where light is taken to leave evenly it is only asked for. Paths end by
/// roulette: from the second bounce on with the light they carry as their chance. Leaves out what
/// took more than `bounces` bounces; no path is longer than kMostBounces. Thread: any. Loop-safe.
/// The target outlives it.
class BouncedLight {
 public:
  static constexpr int kMostBounces = 16;

  BouncedLight(const TracedTarget& target, const BounceRules& rules);
  BouncedLight(const TracedTarget& target, int bounces)
      : BouncedLight(target, BounceRules{bounces}) {}

  /// A path under way. Begins at what the camera sees.
  struct Path {
    SurfacePoint from;
    Eigen::Vector3f direction;  ///< unit; along which `from` was met, then along which it goes on
    SampleNumbers numbers;
    float weight = 1;      ///< light at its end, times this, is light at its beginning
    float density = 0;     ///< of `direction`, per steradian
    float sun_chance = 0;  ///< that `from` asked for the Sun; 0 where the path began
    /// How often `from` asked for the Earth, of which the path may bring its own share; 0: it may
    /// not.
    float earth_asked = 0;
    int bounces = 0;  ///< behind it
  };
  /// Draws where the path goes on. False: it ends.
  [[nodiscard]] bool go_on(Path& path) const noexcept;
  /// What a path brings that has met nothing: the lamp it has run into, in W/m^2/sr.
  [[nodiscard]] double escaped(const LampCones& lamps, const Path& path) const noexcept;

  /// A lamp that a path asks for, and what that brings if nothing is in the way.
  struct Question {
    Eigen::Vector3f toward;
    double light_w_m2_sr = 0;  ///< 0: nothing to ask
  };
  /// Moves the path to the place it has met.
  [[nodiscard]] Question arrive(const LampCones& lamps, Path& path,
                                const SurfacePoint& place) const noexcept;
  [[nodiscard]] bool longest(const Path& path) const noexcept {
    return path.bounces >= rules_.bounces;
  }
  /// As far as its length goes: roulette may end it.
  [[nodiscard]] bool may_go_on(const Path& path) const noexcept {
    return !longest(path) || path.earth_asked > 0.0F;
  }
  /// What the Earth sends by way of `place` to one who looks along the unit vector `direction`, for
  /// a sample of it, when nothing is in the way: less what paths from there run into, where it is
  /// asked for `asked` times for each such path. Its mean over samples, in W/m^2/sr.
  [[nodiscard]] double earthshine(const EarthLight::Sample& sample, const SurfacePoint& place,
                                  const Eigen::Vector3f& direction, double asked) const noexcept;
  [[nodiscard]] int bounces() const noexcept { return rules_.bounces; }

  /// What one path brings, in W/m^2/sr, to a camera that looks at `from` along the unit vector
  /// `direction`. Its mean over paths is the radiance.
  [[nodiscard]] double radiance(const LampCones& lamps, const SurfacePoint& from,
                                const Eigen::Vector3f& direction, const SampleNumbers& numbers,
                                RayCounts& counts) const noexcept;
  /// The same with a Sun that is a point, and numbers by chance.
  [[nodiscard]] double radiance(const Snapshot& snapshot, const SurfacePoint& from,
                                const Eigen::Vector3d& direction, Draws& draws,
                                RayCounts& counts) const noexcept {
    return radiance(lamp_cones(snapshot, 0.0), from, direction.cast<float>(),
                    SampleNumbers(SequenceKind::kIndependent, draws.bits(), 0), counts);
  }

  /// Which pair of a sample's numbers is whose.
  enum Pair : std::uint32_t { kDirectEarth = 0, kDirectDisc = 1, kFirstBounce = 2 };

 private:
  enum PairOfBounce : std::uint32_t { kDirection = 0, kChoice, kLamp, kDisc, kPairs };
  [[nodiscard]] static std::uint32_t pair_of(const Path& path, PairOfBounce which) noexcept {
    return kFirstBounce + static_cast<std::uint32_t>(path.bounces) * kPairs + which;
  }
  [[nodiscard]] Question ask_earth(const EarthLight& earth, Path& path,
                                   const std::array<float, 2>& numbers) const noexcept;

  const TracedTarget& target_;
  BounceRules rules_;
};

/// Of the ladder of bounces. Pre: in [0, BouncedLight::kMostBounces].
[[nodiscard]] Rung bounces_rung(int bounces, double left_out_e) noexcept;

}  // namespace engine
