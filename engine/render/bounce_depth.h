#pragma once

#include "engine/render/render_spec.h"
#include "engine/render/traced_target.h"

namespace engine {

/// How deep light has to be followed on a target before the rest is lost in the sensor's noise.
struct SelfVisibility {
  /// Of the light that leaves what is seen from outside evenly, the share that meets the target
  /// again: mean over the places seen, from everywhere.
  double share = 0;
  double largest_albedo = 0;  ///< of its materials, for light from everywhere
};
/// By a fixed set of rays: the same for the same target.
[[nodiscard]] SelfVisibility self_visibility(const TracedTarget& target);

/// What reaches a pixel of `signal_e` by more than `bounces` bounces, at most, in electrons: the
/// rest of a geometric series, each bounce bringing at most the albedo times the share that is met.
[[nodiscard]] double left_out_e(const SelfVisibility& seen, int bounces, double signal_e) noexcept;

/// Where the spec leaves its bounces open: as many as keep what is left out under the profile's
/// share of the noise, in the brightest pixel that is not clipped. What is left out is noted in any
/// case, where the sensor is known. May throw std::bad_alloc.
[[nodiscard]] RenderSpec with_bounces_settled(const RenderSpec& spec, const TracedTarget& target);

}  // namespace engine
