#pragma once

#include <memory>
#include <vector>

#include "engine/detector/detector.h"
#include "engine/optics/optics.h"
#include "engine/scene/snapshot_builder.h"
#include "engine/scene_generator.h"

namespace engine {

/// Radiance -> irradiance -> electrons -> DN.
class ImagingChain final : public SceneGenerator {
 public:
  /// Reads a clock that only the report depends on.
  using Stopwatch = Duration (*)() noexcept;

  ImagingChain(const SnapshotBuilder& scene, std::unique_ptr<Renderer> renderer, Optics optics,
               Detector detector, const DetectorSpec& detector_spec, const CameraGeometry& camera,
               Stopwatch stopwatch = nullptr, std::unique_ptr<Starlight> stars = nullptr);

  FrameReport expose(const Shot& shot, Budget budget, DnImage& out,
                     TruthMask& mask) noexcept override;

  /// Of the last frame: the light on the detector, free of noise.
  [[nodiscard]] const IrradianceImage& light() const noexcept { return irradiance_; }

 private:
  [[nodiscard]] Duration now() const noexcept {
    return stopwatch_ != nullptr ? stopwatch_() : Duration{};
  }
  /// Blurs the target alone, and measures it.
  void measure_past_companions(Duration exposure, FrameTruth& truth, TruthMask& mask) noexcept;
  /// What is known of the target's light once it has been blurred: truth from peak_e to
  /// signal_to_noise, and the photocentre.
  void measure_light(const PixelRect& window, Duration exposure, FrameTruth& truth,
                     TruthMask& mask) noexcept;
  /// The centre of the target's light that falls into the frame, not blurred; as it was when there
  /// is none.
  void find_own_photocentre(double e_per_irradiance, FrameTruth& truth) const noexcept;

  SnapshotBuilder scene_;
  std::unique_ptr<Renderer> renderer_;
  Optics optics_;
  Detector detector_;
  DetectorSpec detector_spec_;
  Stopwatch stopwatch_;
  std::unique_ptr<Starlight> stars_;  ///< none: a sky without stars
  Radiance radiance_;
  IrradianceImage irradiance_;
  ElectronImage electrons_;
  double ifov_rad_;
  std::vector<float> behind_w_m2_;  ///< a row of the background, on the detector
};

}  // namespace engine
