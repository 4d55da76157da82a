#pragma once

#include <utility>

#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/core/worker_pool.h"
#include "engine/detector/detector_spec.h"
#include "engine/detector/sensor_maps.h"

namespace engine {

/// What of a frame the image does not tell.
struct DetectorReport {
  int full_well_px = 0;  ///< that collected more than the full well
  int no_light_px = 0;   ///< whose irradiance was not a number or negative: taken for darkness
  int cosmic_rays = 0;
  double bloomed_away_e = 0;  ///< that ran off the frame's edges
};

/// Irradiance -> electrons -> DN, in the order of section 4 of the model: light and dark electrons
/// of each pixel's own response and dark current with Poisson noise, cosmic rays, blooming, full
/// well, read noise, pedestal, gain, quantiser, clamp. We differ from Li et al. 2023: 2^bits does
/// not fit into that many bits, so DN end at 2^bits - 1. Leaves out: non-linearity, charge
/// transfer, the noise of rows and columns, what a frame leaves in the next. Thread: loop.
/// Loop-safe but for the constructor.
class Detector {
 public:
  /// Pre: maps, unless they are empty, of the size of the images.
  Detector(DetectorSpec spec, WorkerPool& pool, SensorMaps maps = {})
      : spec_(std::move(spec)), maps_(std::move(maps)), pool_(pool) {}

  DetectorReport expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed,
                        std::uint64_t frame, ElectronImage& out) const noexcept;
  void digitize(const ElectronImage& in, std::uint64_t seed, std::uint64_t frame,
                DnImage& out) const noexcept;

 private:
  /// What more than light fills the wells, and what their edge does to it.
  void fill_wells(Duration exposure, std::uint64_t seed, std::uint64_t frame, ElectronImage& out,
                  DetectorReport& report) const noexcept;

  DetectorSpec spec_;
  SensorMaps maps_;
  WorkerPool& pool_;
};

}  // namespace engine
