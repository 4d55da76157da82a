#include "tools/bench/bounds.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include <benchmark/benchmark.h>

#include "engine/detector/noise_lanes.h"
#include "engine/optics/blur.h"
#include "engine/orbit/sun.h"

namespace bench {

using namespace engine;

void Places::find() {
  const Epoch t = epoch_ + sim_time(kClosest_s).time_since_epoch();
  benchmark::DoNotOptimize(rig_.camera().at(t));
  benchmark::DoNotOptimize(rig_.target().at(t));
  benchmark::DoNotOptimize(sun_position(SunModel::kErfa, t));
}

PictureRays::PictureRays(PassFrames& frames)
    : bodies_(starloop::make_bodies(frames.scenario(), nullptr)),
      embree_(bodies_.target->mesh),
      rays_(rays_of(*bodies_.target, frames.snapshot(), frames.scenario().scene.camera,
                    frames.radiance().oversampling * frames.radiance().oversampling)) {}

void PictureRays::trace() const {
  benchmark::DoNotOptimize(embree_.intersect(rays_.camera.all(), RayCoherence::kParallel));
  benchmark::DoNotOptimize(embree_.occluded(rays_.shadow.all(), RayCoherence::kParallel));
}

void PictureRays::trace_bounced() const {
  benchmark::DoNotOptimize(embree_.intersect(rays_.bounce.all(), RayCoherence::kScattered));
}

Transform transform_of(const PassFrames& frames) {
  const PixelRect window = frames.radiance().region.grown_by(frames.projected().core_px);
  const int cells = frames.radiance().oversampling;
  return {cells * Blur::fast_length(window.width()), cells * Blur::fast_length(window.height())};
}

SensorBounds::SensorBounds(std::size_t pixels) : light_(pixels), electrons_(pixels), dn_(pixels) {}

void SensorBounds::draw_numbers() {
  noise_lanes::normals({1, frame_++, 0}, Stream::kRead, electrons_);
  benchmark::ClobberMemory();
}

void SensorBounds::move_bytes() {
  std::memcpy(electrons_.data(), light_.data(), light_.size() * sizeof(float));
  benchmark::ClobberMemory();
  std::ranges::transform(electrons_, dn_.begin(), [](float e) {
    return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(e) >> 16U);
  });
  benchmark::ClobberMemory();
}

void FrameCopy::copy() {
  std::memcpy(to_.data(), from_.data(), from_.size() * sizeof(std::uint16_t));
  benchmark::ClobberMemory();
}

}  // namespace bench
