#pragma once

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "engine/core/vec.h"

namespace engine {

/// The ladder of the Sun's place, from cheap to exact.
enum class SunModel : std::uint8_t {
  kTable1,  ///< mean elements, precessed: within 45" of the truth from 2000 to 2050
  kErfa,    ///< eraEpv00: within 1", distance within 1e-5
};

/// In-band sunlight, 450-850 nm.
struct SunSpec {
  SunModel model = SunModel::kErfa;
  double irradiance_1au_w_m2 = 623.677;  ///< ASTM E490-00a
  bool scales_with_distance = true;      ///< a plain number in the scenario holds at the target
  double mean_wavelength_m = 626.78e-9;  ///< energy-weighted: photons = energy * it / (h c)
};
[[nodiscard]] SunSpec read_sun(const ConfigTable& table);

/// The Sun from the Earth's centre, geometric, in J2000.
[[nodiscard]] Position<J2000> sun_position(SunModel model, Epoch t) noexcept;

/// The same as light from it comes to what moves with the Earth, turned by the Earth's velocity:
/// up to 20.5". The Sun itself moves 13 m/s: light time adds 9e-3". Leaves out: a satellite's own
/// velocity, 5" of the light that comes and of the light that goes.
[[nodiscard]] Position<J2000> apparent_sun_position(SunModel model, Epoch t) noexcept;

/// The Earth's centre about the solar system's barycentre, in J2000, by eraEpv00: within 5 mm/s.
[[nodiscard]] Velocity<J2000> earth_velocity(Epoch t) noexcept;

/// Mean place of date by table 1 of Li et al. 2023: the Sun from the Earth's centre on the mean
/// equator and equinox of date, in metres.
///
/// We differ from the print: e = .01670862 - .00004204 T - .000000124 T^2, and the powers of T in
/// the inclination. The paper takes the result for J2000; it is of date, 1130" off in 2022.
[[nodiscard]] Eigen::Vector3d table1_sun_of_date_m(double tt_centuries) noexcept;

/// Irradiance at `distance_m` from the Sun.
[[nodiscard]] double sun_irradiance_w_m2(const SunSpec& spec, double distance_m) noexcept;

/// Eq 5-6 of Li et al. 2023: a black body of 5900 K and radius 6.9599e8 m, with the constants
/// printed there. At 1.521e11 m: 633.460 W/m^2 (its 634.64 counts both ends of a Riemann sum).
struct BlackBodySun {
  double irradiance_w_m2 = 0;
  double mean_wavelength_m = 0;  ///< energy-weighted
};
[[nodiscard]] BlackBodySun black_body_sun(double distance_m) noexcept;

}  // namespace engine
