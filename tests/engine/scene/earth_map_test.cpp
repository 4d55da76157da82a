#include "engine/scene/earth_map.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/orbit/utc.h"
#include "engine/scene/earth.h"

namespace engine {
namespace {

using Eigen::Vector3d;

Vector3d place(double north_deg, double east_deg) {
  const double lat = north_deg * kDegree;
  const double lon = east_deg * kDegree;
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}
ZonalAlbedo of(const char* utc) { return zonal_albedo(epoch_from_utc(utc).value()); }
const std::vector<const char*> kSeasons = {"2022-01-10T00:00:00", "2022-03-23T00:00:00",
                                           "2022-06-22T00:00:00"};
/// Of no season.
constexpr ZonalAlbedo kAllYear{{0.34, 0.0, 0.29}};

TEST(EarthMap, SharesEachParallelsAlbedoOutAndKeepsItsMean) {
  for (const char* season : kSeasons) {
    const ZonalAlbedo zonal = of(season);
    for (double north_deg = -89.9; north_deg < 90.0; north_deg += 1.3) {
      double sum = 0;
      constexpr int kSteps = 720;
      for (int i = 0; i < kSteps; ++i)
        sum += place_albedo(zonal, place(north_deg, 0.11 + i * 360.0 / kSteps)) / kSteps;
      // Of a spline of 180 cells even steps, four a cell, make the mean exactly.
      EXPECT_NEAR(sum, zonal.at(std::sin(north_deg * kDegree)), 1e-12) << north_deg;
    }
  }
}

TEST(EarthMap, InAYearsSunlightTheEarthSendsBackWhatIsMeasured) {
  // Annual mean sunlight by latitude: 1 - .482 P2 (North 1975, DOI
  // 10.1175/1520-0469(1975)032<2033:TOASCM>2.0.CO;2).
  double all = 0;
  double clear = 0;
  double sunlight = 0;
  for (double s = -0.9975; s < 1.0; s += 0.005) {
    const double sun = 1.0 - 0.482 * 0.5 * (3.0 * s * s - 1.0);
    for (double east_deg = -179.5; east_deg < 180.0; east_deg += 1.0) {
      const Vector3d p = place(std::asin(s) / kDegree, east_deg);
      all += sun * place_albedo(kAllYear, p);
      clear += sun * clear_place_albedo(p);
      sunlight += sun;
    }
  }
  // Loeb et al. 2018: 99.1 of 340.0 W/m^2, and 53.3 where there are no clouds. Knocke's zones are
  // from a budget that had .30 to .31 for the former; kinds of ground are good to .01.
  EXPECT_NEAR(all / sunlight, 99.1 / 340.0, 0.025);
  EXPECT_NEAR(clear / sunlight, 53.3 / 340.0, 0.01);
}

TEST(EarthMap, IsDarkOverTheSeaAndBrightOverDesertsAndIce) {
  for (const char* season : kSeasons) {
    const ZonalAlbedo zonal = of(season);
    const auto at = [&](double n, double e) { return place_albedo(zonal, place(n, e)); };
    const double pacific = at(-15.0, -130.0);
    const double atlantic = at(22.0, -40.0);
    const double sahara = at(24.0, 10.0);
    const double australia = at(-25.0, 128.0);
    EXPECT_LT(pacific, 0.28);
    EXPECT_LT(atlantic, 0.28);
    EXPECT_GT(sahara, atlantic + 0.08);
    EXPECT_GT(sahara, 0.3);
    EXPECT_GT(australia, pacific + 0.08);
    EXPECT_GT(at(-4.0, -62.0), at(-4.0, -25.0));      // the Amazon, the Atlantic beside it
    EXPECT_GT(at(74.0, -40.0), at(74.0, 5.0) + 0.1);  // Greenland, the sea beside it
    EXPECT_GT(at(-82.0, 60.0), sahara);               // Antarctica
  }
}

TEST(EarthMap, AgreesWithAnAtlas) {
  // By clear ground, far from coasts: where the sea is, where land, deserts and ice are.
  const auto clear = [](double n, double e) { return clear_place_albedo(place(n, e)); };
  for (const auto& [n, e] : {std::pair{0.0, -150.0},
                             {-30.0, 80.0},
                             {30.0, -45.0},
                             {-45.0, 179.9},
                             {45.0, -179.9},
                             {10.0, 65.0},
                             {-20.0, -10.0},
                             {0.0, 0.0}})
    EXPECT_NEAR(clear(n, e), 0.10, 0.005) << n << " " << e;
  for (const auto& [n, e] : {std::pair{-8.0, -55.0},
                             {0.0, 23.0},
                             {22.0, 78.0},
                             {28.0, 112.0},
                             {35.0, -88.0},
                             {-13.0, 26.0}})
    EXPECT_NEAR(clear(n, e), 0.18, 0.02) << n << " " << e;
  for (const auto& [n, e] : {std::pair{22.0, 5.0}, {24.0, 28.0}, {21.0, 48.0}, {-25.0, 128.0}})
    EXPECT_NEAR(clear(n, e), 0.32, 0.02) << n << " " << e;
  for (const auto& [n, e] : {std::pair{-80.0, 90.0}, {-75.0, 45.0}, {74.0, -40.0}, {-89.0, 3.0}})
    EXPECT_NEAR(clear(n, e), 0.66, 0.02) << n << " " << e;
}

TEST(EarthMap, HasNoSeamAtTheDateLineAndNoneAtThePoles) {
  const auto at = [](double n, double e) { return place_albedo(kAllYear, place(n, e)); };
  for (double n = -89.0; n < 90.0; n += 0.7)
    EXPECT_NEAR(at(n, 180.0 - 1e-9), at(n, -180.0 + 1e-9), 1e-9) << n;
  for (const double pole : {-90.0, 90.0})
    for (double e = -180.0; e < 180.0; e += 7.0)
      EXPECT_NEAR(at(pole - std::copysign(1e-7, pole), e), at(pole, 0.0), 1e-8) << e;
}

TEST(EarthMap, RisesSmoothlyAcrossItsCells) {
  // The slopes on both sides of any place are the same: of a spline of second degree they differ
  // by its second derivative times the step, 4 h / cell^2 of the largest step between two cells.
  constexpr double kStep_deg = 0.01;
  const auto along = [](bool north, double fixed_deg, double moving_deg) {
    return place_albedo(kAllYear,
                        north ? place(moving_deg, fixed_deg) : place(fixed_deg, moving_deg));
  };
  for (const bool north : {true, false}) {
    for (const double fixed_deg : {-25.0, 5.3, 24.0, 49.0, 70.0}) {
      for (double d = -60.0; d < 60.0; d += 0.5) {
        const double before = along(north, fixed_deg, d - kStep_deg);
        const double here = along(north, fixed_deg, d);
        const double after = along(north, fixed_deg, d + kStep_deg);
        EXPECT_LT(std::abs(after - 2.0 * here + before), 0.6 * kStep_deg * kStep_deg) << d;
        // Half of the largest step in a half cell.
        EXPECT_LT(std::abs(after - before), 0.6 * kStep_deg) << d;
      }
    }
  }
}

TEST(EarthMap, NoPlaceHasMoreThanTheLargestAndAllAreShares) {
  Draws draws(11, Stream::kLight, 0, 0);
  for (const ZonalAlbedo& zonal :
       {of(kSeasons[0]), of(kSeasons[1]), of(kSeasons[2]), kAllYear, ZonalAlbedo{}}) {
    const double largest = largest_place_albedo(zonal);
    double most = 0;
    for (int i = 0; i < 100000; ++i) {
      const double north_deg = std::asin(2.0 * draws.uniform_double() - 1.0) / kDegree;
      const double albedo = place_albedo(zonal, place(north_deg, 360.0 * draws.uniform_double()));
      ASSERT_GT(albedo, 0.0);
      most = std::max(most, albedo);
    }
    EXPECT_LE(most, largest);
    EXPECT_LT(largest, std::min(1.0, most + 0.1));
  }
}

}  // namespace
}  // namespace engine
