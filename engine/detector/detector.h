#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/core/worker_pool.h"

namespace engine {

enum class Quantiser : std::uint8_t { kFloor, kRound };

struct DetectorSpec {
  double quantum_efficiency = 0.55;  ///< in (0, 1], mean over the band
  double full_well_e = 30000;
  double read_noise_e = 2;  ///< rms, per read
  double dark_e_s = 35;
  int bits = 11;
  double pedestal_dn = 0;
  Quantiser quantiser = Quantiser::kFloor;
  double pixel_pitch_m = 6.5e-6;
  double mean_wavelength_m = 626.78e-9;  ///< energy-weighted: sets the energy of a photon

  [[nodiscard]] double gain_e_dn() const noexcept { return full_well_e / (1 << bits); }
  [[nodiscard]] int largest_dn() const noexcept { return (1 << bits) - 1; }
  /// Electrons for 1 W/m^2 on a pixel over `exposure`.
  [[nodiscard]] double electrons_per_irradiance(Duration exposure) const noexcept;
  /// rms in electrons, of a pixel that collects `mean_e` in all.
  [[nodiscard]] double noise_e(double mean_e) const noexcept;
};
[[nodiscard]] DetectorSpec read_detector(const ConfigTable& table, double pixel_pitch_m,
                                         double mean_wavelength_m);

/// Irradiance -> electrons -> DN, in the order of section 4 of the model: light and dark electrons
/// with Poisson noise, full well, read noise, pedestal, gain, quantiser, clamp.
/// We differ from Li et al. 2023: 2^bits does not fit into that many bits, so DN end at 2^bits - 1.
/// Leaves out: PRNU, DSNU, defects, blooming, cosmic rays.
/// Thread: loop. Loop-safe but for the constructor.
class Detector {
 public:
  Detector(const DetectorSpec& spec, WorkerPool& pool) : spec_(spec), pool_(pool) {}

  /// An irradiance that is not a number, or below zero, counts as darkness.
  void expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed, std::uint64_t frame,
              ElectronImage& out) const noexcept;
  void digitize(const ElectronImage& in, std::uint64_t seed, std::uint64_t frame,
                DnImage& out) const noexcept;

 private:
  void expose_row(std::span<const float> light, Duration exposure, std::uint64_t seed,
                  std::uint64_t frame, std::uint32_t first,
                  std::span<float> collected) const noexcept;

  DetectorSpec spec_;
  WorkerPool& pool_;
};

}  // namespace engine
