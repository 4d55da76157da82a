#pragma once

#include <numbers>

namespace engine {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDegree = kPi / 180.0;

inline constexpr double kSpeedOfLight_m_s = 299792458.0;       // SI 2019, exact
inline constexpr double kPlanck_j_s = 6.62607015e-34;          // SI 2019, exact
inline constexpr double kAstronomicalUnit_m = 149597870700.0;  // IAU 2012 B2, exact
/// EGM96 gravitational parameter, as the paper and STK use it.
inline constexpr double kEarthMu_m3_s2 = 398600.4418e9;
/// Equatorial radius, WGS 84 rounded as the paper and STK have it; the model's Earth is a sphere.
inline constexpr double kEarthRadius_m = 6378137.0;
/// Half the Sun's apparent diameter at 1 au: 6.957e8 m (IAU 2015 B3) over 1 au.
inline constexpr double kSunAngularRadius_rad = 4.6505e-3;

}  // namespace engine
