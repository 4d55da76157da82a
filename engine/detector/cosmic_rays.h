#pragma once

#include <cstdint>
#include <span>

#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/detector/detector_spec.h"

namespace engine {

/// Adds what charged particles leave in a frame, in whole electrons along straight tracks. Returns
/// how many there were.
///
/// Their number is Poisson; they come through the sensor's face, isotropic: the cosine of their
/// angle to its normal is the root of a uniform number. On each micrometre of the epitaxial
/// layer a track leaves 80 e- as the most probable value (minimum ionising, Groom and Klein,
/// "Passage of particles through matter", Review of Particle Physics 2022, DOI
/// 10.1093/ptep/ptac097, fig. 34.8) with the spread of Moyal's approximation to Landau's
/// distribution (Moyal 1955, DOI 10.1080/14786440308521076), whose width, 4.9 e- per micrometre, is
/// that review's xi for silicon. In layers as thin as this the real spread is some twice as wide
/// (Bichsel 1988, DOI 10.1103/RevModPhys.60.663). Leaves out: other particles than minimum ionising
/// ones, stopping and delta electrons, diffusion below the layer, and what enters by the sides.
/// Pixels of no `response` collect nothing; empty: there are none.
/// Thread: loop. Loop-safe.
int add_cosmic_rays(const DetectorSpec& spec, Duration exposure, std::uint64_t seed,
                    std::uint64_t frame, std::span<const float> response,
                    ElectronImage& electrons) noexcept;

}  // namespace engine
