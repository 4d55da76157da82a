#include "tools/characterize/bench.h"

#include <numeric>

namespace characterize {

Bench::Bench(engine::Optics& optics, const engine::DetectorSpec& detector,
             const engine::SensorMaps& maps, const engine::CameraGeometry& camera,
             engine::WorkerPool& pool, std::uint64_t seed)
    : optics_(optics),
      detector_(detector, pool, maps),
      photometer_(detector),
      camera_(camera),
      seed_(seed),
      irradiance_(camera.width_px, camera.height_px),
      electrons_(camera.width_px, camera.height_px),
      dn_(camera.width_px, camera.height_px) {
  photometer_.quantum_efficiency = 1.0;
  illuminate(0.0);
}

void Bench::illuminate(double irradiance_w_m2) {
  engine::Radiance sphere;
  sphere.uniform_w_m2_sr = irradiance_w_m2 / optics_.throughput_sr();
  illuminate(sphere);
}

void Bench::illuminate(const engine::Radiance& light) { optics_.project(light, irradiance_); }

double Bench::irradiance_w_m2() const noexcept {
  const auto pixels = irradiance_.pixels();
  return std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
}

const engine::DnImage& Bench::frame(engine::Duration exposure) {
  detector_.expose(irradiance_, exposure, seed_, frames_, electrons_);
  detector_.digitize(electrons_, seed_, frames_, dn_);
  ++frames_;
  return dn_;
}

ImageStack Bench::stack(engine::Duration exposure, int frames, const PixelMask& mask) {
  ImageStack stack(mask);
  for (int i = 0; i < frames; ++i) stack.add(frame(exposure));
  return stack;
}

}  // namespace characterize
