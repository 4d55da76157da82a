#pragma once

#include <cstdint>

#include "engine/detector/detector.h"
#include "engine/optics/optics.h"
#include "engine/render/renderer.h"
#include "tools/characterize/image_stack.h"

namespace characterize {

/// A camera on a bench: light into its optics, frames out of its detector, and a calibrated
/// photometer beside its pixels. Nothing else is known of it. Frames of one bench all have other
/// noise. Optics and pool outlive it.
class Bench {
 public:
  Bench(engine::Optics& optics, const engine::DetectorSpec& detector,
        const engine::SensorMaps& maps, const engine::CameraGeometry& camera,
        engine::WorkerPool& pool, std::uint64_t seed);

  /// What the sensor sees from now on. An integrating sphere that lets so much light fall on each
  /// pixel; 0: a lid.
  void illuminate(double irradiance_w_m2);
  void illuminate(const engine::Radiance& light);
  [[nodiscard]] double throughput_sr() const noexcept { return optics_.throughput_sr(); }
  [[nodiscard]] engine::GridWish wish() const noexcept { return optics_.wish(); }

  /// Mean over the pixels.
  [[nodiscard]] double irradiance_w_m2() const noexcept;
  /// On a pixel, of the band's mean energy, for 1 W/m^2.
  [[nodiscard]] double photons_per_irradiance(engine::Duration exposure) const noexcept {
    return photometer_.electrons_per_irradiance(exposure);
  }
  [[nodiscard]] const engine::CameraGeometry& camera() const noexcept { return camera_; }
  [[nodiscard]] int largest_dn() const noexcept { return photometer_.largest_dn(); }

  /// The next frame; valid until the one after it.
  const engine::DnImage& frame(engine::Duration exposure);
  [[nodiscard]] ImageStack stack(engine::Duration exposure, int frames, const PixelMask& mask);

 private:
  engine::Optics& optics_;
  engine::Detector detector_;
  engine::DetectorSpec photometer_;  ///< an electron for each photon
  engine::CameraGeometry camera_;
  std::uint64_t seed_;
  std::uint64_t frames_ = 0;
  engine::IrradianceImage irradiance_;
  engine::ElectronImage electrons_;
  engine::DnImage dn_;
};

}  // namespace characterize
