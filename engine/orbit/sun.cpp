#include "engine/orbit/sun.h"

#include <erfa.h>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/utc.h"

namespace engine {
namespace {

constexpr double kArcsecond = kDegree / 3600.0;
constexpr double kDaysPerCentury = 36525.0;
constexpr double kBandLow_m = 450e-9;
constexpr double kBandHigh_m = 850e-9;

double dms(double degrees, double minutes, double arcseconds) noexcept {
  return (degrees * 3600.0 + minutes * 60.0 + arcseconds) * kArcsecond;
}

Position<J2000> from_table1(Epoch t) noexcept {
  const TwoPartDate tt = terrestrial_time(t);
  const Eigen::Vector3d of_date_m =
      table1_sun_of_date_m((tt.day1 - 2451545.0 + tt.day2) / kDaysPerCentury);
  double to_date[3][3];  // bias and precession, IAU 2006: GCRS to mean of date
  eraPmat06(tt.day1, tt.day2, to_date);
  double of_date[3] = {of_date_m.x(), of_date_m.y(), of_date_m.z()};
  double gcrs[3];
  eraTrxp(to_date, of_date, gcrs);
  return {{gcrs[0], gcrs[1], gcrs[2]}};
}

Position<J2000> from_erfa(Epoch t) noexcept {
  const TwoPartDate tt = terrestrial_time(t);  // TDB - TT stays under 2 ms: 0.3 mas of the Sun
  double heliocentric[2][3];
  double barycentric[2][3];
  eraEpv00(tt.day1, tt.day2, heliocentric, barycentric);
  const Eigen::Vector3d earth_au(heliocentric[0][0], heliocentric[0][1], heliocentric[0][2]);
  return {-kAstronomicalUnit_m * earth_au};
}

}  // namespace

Eigen::Vector3d table1_sun_of_date_m(double t) noexcept {
  const double e = 0.01670862 + t * (-0.00004204 + t * -0.000000124);
  const double i =
      dms(23, 26, 21.448) + t * (-46.8150 + t * (-0.00059 + t * 0.001813)) * kArcsecond;
  const double w = dms(282, 56, 14.45) + t * (6190.32 + t * (1.655 + t * 0.012)) * kArcsecond;
  const double m =
      dms(357, 31, 44.76) + t * (129596581.04 + t * (-0.562 + t * -0.012)) * kArcsecond;
  constexpr double kSemiMajorAxis_m = 149597870e3;
  const double e_anomaly = solve_kepler(e, m).rad;
  const double p = kSemiMajorAxis_m * (std::cos(e_anomaly) - e);
  const double q = kSemiMajorAxis_m * std::sqrt(1.0 - e * e) * std::sin(e_anomaly);
  const double along = p * std::cos(w) - q * std::sin(w);
  const double across = p * std::sin(w) + q * std::cos(w);
  return {along, across * std::cos(i), across * std::sin(i)};
}

Position<J2000> sun_position(SunModel model, Epoch t) noexcept {
  return model == SunModel::kTable1 ? from_table1(t) : from_erfa(t);
}

Position<J2000> apparent_sun_position(SunModel model, Epoch t) noexcept {
  const Position<J2000> sun = sun_position(model, t);
  const double distance_m = sun.m.norm();
  return {distance_m * aberrated(sun.m / distance_m, earth_velocity(t))};
}

Velocity<J2000> earth_velocity(Epoch t) noexcept {
  const TwoPartDate tt = terrestrial_time(t);
  double heliocentric[2][3];
  double barycentric[2][3];
  eraEpv00(tt.day1, tt.day2, heliocentric, barycentric);
  const Eigen::Vector3d au_day(barycentric[1][0], barycentric[1][1], barycentric[1][2]);
  return {au_day * (kAstronomicalUnit_m / 86400.0)};
}

double sun_irradiance_w_m2(const SunSpec& spec, double distance_m) noexcept {
  if (!spec.scales_with_distance) return spec.irradiance_1au_w_m2;
  const double au = kAstronomicalUnit_m / distance_m;
  return spec.irradiance_1au_w_m2 * au * au;
}

BlackBodySun black_body_sun(double distance_m) noexcept {
  constexpr double kC1_w_m2 = 3.742e-16;
  constexpr double kC2_m_k = 1.4388e-2;
  constexpr double kTemperature_k = 5900.0;
  constexpr double kSunRadius_m = 6.9599e8;
  // Simpson's rule: 400 steps of 1 nm leave 1e-9.
  constexpr int kSteps = 400;
  constexpr double kStep_m = (kBandHigh_m - kBandLow_m) / kSteps;
  double energy = 0;
  double energy_wavelength = 0;
  for (int k = 0; k <= kSteps; ++k) {
    const double weight = (k == 0 || k == kSteps) ? 1.0 : (k % 2 == 1 ? 4.0 : 2.0);
    const double l = kBandLow_m + k * kStep_m;
    const double exitance = kC1_w_m2 / std::pow(l, 5) / std::expm1(kC2_m_k / (l * kTemperature_k));
    energy += weight * exitance;
    energy_wavelength += weight * exitance * l;
  }
  const double dilution = (kSunRadius_m / distance_m) * (kSunRadius_m / distance_m);
  return {energy * kStep_m / 3.0 * dilution, energy_wavelength / energy};
}

SunSpec read_sun(const ConfigTable& table) {
  SunSpec spec;
  spec.model = table.choice_or<SunModel>(
      "position", "erfa", {{"erfa", SunModel::kErfa}, {"table-1", SunModel::kTable1}});
  if (table.has("irradiance") && !table.is_text("irradiance")) {
    spec.irradiance_1au_w_m2 = table.number("irradiance", positive());
    spec.scales_with_distance = false;
  } else if (table.choice_or<bool>("irradiance", "measured",
                                   {{"measured", false}, {"black-body", true}})) {
    const BlackBodySun sun = black_body_sun(kAstronomicalUnit_m);
    spec.irradiance_1au_w_m2 = sun.irradiance_w_m2;
    spec.mean_wavelength_m = sun.mean_wavelength_m;
  }
  spec.mean_wavelength_m =
      table.number_or("wavelength_nm", spec.mean_wavelength_m * 1e9, between(450.0, 850.0)) * 1e-9;
  return spec;
}

}  // namespace engine
