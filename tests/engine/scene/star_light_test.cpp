#include "engine/scene/star_light.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr double kMeanWavelength_m = 626.78e-9;

TEST(StarLight, TheSunAmongStarsGivesTheMeasuredSolarIrradiance) {
  // V = -26.74 and B-V = .653 (Willmer 2018, Ramirez et al. 2012); ASTM E490: 623.7 W/m^2 in band.
  const BandLight sun = band_light_at_zero(0.653);
  const double brighter = std::pow(10.0, 0.4 * 26.74);
  EXPECT_NEAR(sun.irradiance_w_m2 * brighter / 623.7, 1.0, 0.01);
  EXPECT_NEAR(StarLight(kMeanWavelength_m).irradiance_w_m2(-26.74, 0.653) / 623.7, 1.0, 0.01);
  EXPECT_NEAR(colour_temperature_k(0.653), 5772.0, 30.0);
}

TEST(StarLight, VegaSendsThePhotonsOfItsMeasuredSpectrum) {
  // Mean fluxes of Vega-like light at magnitude 0 in B, V, R, I (Bessell, Castelli & Plez 1998,
  // table A2), straight lines between their logarithms; Vega itself is at .03.
  constexpr std::array<std::array<double, 2>, 4> kFlux{
      {{438.0, 6.32e-11}, {545.0, 3.631e-11}, {641.0, 2.177e-11}, {798.0, 1.126e-11}}};
  double photons_m2_s = 0;
  for (int nm = 450; nm < 850; ++nm) {
    const double l = nm + 0.5;
    std::size_t i = 1;
    while (i + 1 < kFlux.size() && l > kFlux[i][0]) ++i;
    const double part = std::log(l / kFlux[i - 1][0]) / std::log(kFlux[i][0] / kFlux[i - 1][0]);
    const double flux = kFlux[i - 1][1] * std::pow(kFlux[i][1] / kFlux[i - 1][1], part);
    photons_m2_s += flux * l * 1e-9 / (kPlanck_j_s * kSpeedOfLight_m_s);
  }
  // A black body of 10 000 K is that much too bright beyond the Balmer jump, as the header says.
  EXPECT_NEAR(band_light_at_zero(0.0).photons_m2_s / photons_m2_s, 1.09, 0.02);
}

TEST(StarLight, FiveMagnitudesAreAFactorOfAHundred) {
  const StarLight light(kMeanWavelength_m);
  for (const double colour : {-0.3, 0.0, 0.61, 1.8})
    EXPECT_NEAR(light.irradiance_w_m2(3.0, colour) / light.irradiance_w_m2(8.0, colour), 100.0,
                1e-9);
}

TEST(StarLight, CountsPhotonsWhateverTheirColour) {
  const StarLight light(kMeanWavelength_m);
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / kMeanWavelength_m;
  for (const double colour : {-0.31, 0.123, 0.9, 1.51, 3.0}) {
    // Straight lines between tabulated colours leave 2e-5.
    EXPECT_NEAR(
        light.irradiance_w_m2(0.0, colour) / photon_j / band_light_at_zero(colour).photons_m2_s,
        1.0, 2e-5)
        << colour;
  }
}

TEST(StarLight, ColoursOutOfRangeGiveFiniteLight) {
  const StarLight light(kMeanWavelength_m);
  for (const double colour : {-1e9, -0.7, 7.0, 1e9}) {
    EXPECT_GT(light.irradiance_w_m2(5.0, colour), 0.0);
    EXPECT_TRUE(std::isfinite(light.irradiance_w_m2(5.0, colour)));
  }
}

}  // namespace
}  // namespace engine
