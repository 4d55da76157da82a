#pragma once

#include "engine/imaging_chain.h"
#include "tools/starloop/rig.h"

namespace starloop {

/// One exposure's images between the stages of the chain, for who repeats a stage: without stars.
/// Renders what the camera sees of a snapshot.
[[nodiscard]] engine::Radiance render_radiance(const engine::CameraGeometry& camera,
                                               const engine::Snapshot& snapshot,
                                               const engine::GridWish& wish,
                                               engine::Renderer& renderer);
/// What of it reaches the detector, veiling glare included. Pre: rendered for optics of the same
/// oversampling, whose light spreads as far.
[[nodiscard]] engine::IrradianceImage projected(engine::Optics& optics,
                                                const engine::Radiance& radiance,
                                                const engine::CameraGeometry& camera);

}  // namespace starloop
