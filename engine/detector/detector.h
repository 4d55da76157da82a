#pragma once

#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/core/worker_pool.h"
#include "engine/detector/detector_spec.h"

namespace engine {

/// What of a frame the image does not tell.
struct DetectorReport {
  int full_well_px = 0;  ///< that collected more than the full well
  int no_light_px = 0;   ///< whose irradiance was not a number or negative: taken for darkness
};

/// Irradiance -> electrons -> DN, in the order of section 4 of the model: light and dark electrons
/// with Poisson noise, full well, read noise, pedestal, gain, quantiser, clamp.
/// We differ from Li et al. 2023: 2^bits does not fit into that many bits, so DN end at 2^bits - 1.
/// Leaves out: PRNU, DSNU, defects, blooming, cosmic rays.
/// Thread: loop. Loop-safe but for the constructor.
class Detector {
 public:
  Detector(const DetectorSpec& spec, WorkerPool& pool) : spec_(spec), pool_(pool) {}

  DetectorReport expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed,
                        std::uint64_t frame, ElectronImage& out) const noexcept;
  void digitize(const ElectronImage& in, std::uint64_t seed, std::uint64_t frame,
                DnImage& out) const noexcept;

 private:
  DetectorSpec spec_;
  WorkerPool& pool_;
};

}  // namespace engine
