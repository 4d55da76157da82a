#pragma once

#include <cstdint>
#include <string>

#include "engine/core/config_reader.h"
#include "engine/core/time.h"

namespace engine {

enum class Quantiser : std::uint8_t { kFloor, kRound };
enum class Blooming : std::uint8_t { kNone, kColumn };

/// A FITS file of the user's; without a path there is none.
struct MapFile {
  std::string path;
  std::string where;  ///< the place in the scenario that names it
};

/// What a detector is like: table [detector] of a scenario.
struct DetectorSpec {
  double quantum_efficiency = 0.55;  ///< in (0, 1], mean over the band
  double full_well_e = 30000;
  double read_noise_e = 2;  ///< rms, per read
  double dark_e_s = 35;     ///< at dark_reference_c, where that counts
  /// Dark current doubles every so many degrees (EMVA 1288 release 4, section 7); 0: it does not
  /// depend on the temperature.
  double dark_doubling_c = 0;
  double dark_reference_c = 0;
  double temperature_c = 0;
  double background_e_s = 0;  ///< light leaks and glow
  int bits = 11;
  double pedestal_dn = 0;
  Quantiser quantiser = Quantiser::kFloor;
  double pixel_pitch_m = 6.5e-6;  ///< of pixels as they are read out
  /// Photosites on a side of such a pixel: their charge is added up before it is read. Dark current
  /// and background are a photosite's, full well and read noise the pixel's.
  int binning = 1;
  double mean_wavelength_m = 626.78e-9;  ///< energy-weighted: sets the energy of a photon

  std::uint64_t sensor = 1;   ///< serial number: what its maps are drawn from, whatever the seed
  double prnu_rms = 0;        ///< of the mean response, in [0, 1]
  double dsnu_rms = 0;        ///< of the mean dark current
  MapFile prnu_map;           ///< response of each pixel, 1 being the mean's; instead of prnu_rms
  MapFile dsnu_map;           ///< dark current of each pixel, 1 being dark_e_s; instead of dsnu_rms
  double hot_pixels = 0;      ///< share of all
  double hot_dark_e_s = 1e4;  ///< mean of what hot pixels and columns have besides, exponential
  double dead_pixels = 0;     ///< share of all
  int hot_columns = 0;
  int dead_columns = 0;
  std::string columns_where;  ///< the place in the scenario that says how many

  Blooming blooming = Blooming::kNone;
  double cosmic_rays_cm2_s = 0;  ///< through the sensor's face
  double epitaxial_um = 15;      ///< depth that collects what they leave

  static constexpr double kLargestResponse = 10;
  static constexpr double kLargestDark = 1e6;  ///< of dark_e_s

  [[nodiscard]] double gain_e_dn() const noexcept { return full_well_e / (1 << bits); }
  [[nodiscard]] int largest_dn() const noexcept { return (1 << bits) - 1; }
  /// Electrons for 1 W/m^2 on a pixel over `exposure`.
  [[nodiscard]] double electrons_per_irradiance(Duration exposure) const noexcept;
  /// Dark current at temperature_c over that at dark_reference_c.
  [[nodiscard]] double dark_factor() const noexcept;
  /// Of a pixel.
  [[nodiscard]] double dark_rate_e_s() const noexcept {
    return dark_e_s * dark_factor() * binning * binning;
  }
  /// What an average pixel collects over `exposure` without light, background included.
  [[nodiscard]] double dark_mean_e(Duration exposure) const noexcept;
  /// rms in electrons, of a pixel that collects `mean_e` in all.
  [[nodiscard]] double noise_e(double mean_e) const noexcept;
};
[[nodiscard]] DetectorSpec read_detector(const ConfigTable& table, double pixel_pitch_m,
                                         double mean_wavelength_m);

}  // namespace engine
