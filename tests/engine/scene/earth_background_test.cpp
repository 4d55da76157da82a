#include "engine/scene/earth_background.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kSun_w_m2 = 633.0;

/// The Earth's centre so far off the boresight, towards v; the Sun so far from the zenith of the
/// place below the camera, towards u.
EarthInFrame earth_at(double height_km, double off_boresight_deg, double zenith_deg) {
  EarthInFrame earth;
  EarthDisc<CameraFrame>& disc = earth.disc;
  const double off = off_boresight_deg * kDegree;
  disc.to_centre.unit = {0.0, std::sin(off), std::cos(off)};
  const double z = zenith_deg * kDegree;
  disc.to_sun.unit = std::sin(z) * Vector3d::UnitX() - std::cos(z) * disc.to_centre.unit;
  disc.distance_radii = 1.0 + height_km * 1e3 / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = kSun_w_m2;
  return earth;
}

double limb_deg(const EarthInFrame& earth) {
  return std::asin(1.0 / earth.disc.distance_radii) / kDegree;
}

CameraGeometry camera_of(double focal_length_m) {
  CameraGeometry camera = test_support::small_camera(256);
  camera.focal_length_m = focal_length_m;
  return camera;
}

TEST(EarthBackground, SunlitGroundIsLambertsSphere) {
  EarthBackground background;
  background.reserve(camera_of(4.5), 64);
  background.draw(earth_at(500.0, 0.0, 80.0), 0.0);
  ASSERT_FALSE(background.empty());
  // .3 * 633 / pi * cos 80: 10.5 W/m^2/sr.
  const double want = 0.3 * kSun_w_m2 / kPi * std::cos(80.0 * kDegree);
  EXPECT_NEAR(want, 10.5, 0.01);
  EXPECT_NEAR(background.at({128.0, 128.0}), want, 1e-9);
}

TEST(EarthBackground, RowsAreWithinTheStatedErrorOfEachPixelsOwnLight) {
  for (const double focal_length_m : {4.5, 0.3, 0.05}) {
    EarthBackground background;
    background.reserve(camera_of(focal_length_m), 64);
    for (const double zenith_deg : {20.0, 70.0, 90.0, 110.0}) {
      for (const double inside_deg : {-0.3, -0.02, 0.0, 0.02, 0.3, 3.0, 10.0}) {
        SCOPED_TRACE(std::to_string(focal_length_m) + " m, Sun " + std::to_string(zenith_deg) +
                     " deg, limb " + std::to_string(inside_deg) + " deg off");
        EarthInFrame earth = earth_at(500.0, 0.0, zenith_deg);
        earth = earth_at(500.0, limb_deg(earth) - inside_deg, zenith_deg);
        background.draw(earth, 1e-6);
        // Nodes cannot tell more than about twice what second differences say.
        const double dark = 2.0 * EarthBackground::kDarkShare * 0.3 * kSun_w_m2 / kPi;
        std::vector<float> row(256 + 2 * 64);
        double most = 0;
        for (int v = -64; v < 256 + 64; v += 3) {
          std::ranges::fill(row, 0.0F);
          background.add_row(v, -64, 1.0F, row);
          for (int k = 0; k < static_cast<int>(row.size()); ++k) {
            const double want = background.at({k - 64.0, 1.0 * v});
            most = std::max(most, std::abs(row[static_cast<std::size_t>(k)] - want) -
                                      2.0 * EarthBackground::kUnseenShare * std::abs(want));
          }
        }
        EXPECT_LE(most, dark);
      }
    }
  }
}

TEST(EarthBackground, IsEmptyExactlyWhenNothingOfTheEarthIsInTheFrame) {
  EarthBackground background;
  EXPECT_TRUE(background.empty());
  background.reserve(camera_of(4.5), 0);
  for (const double air : {0.0, 0.077}) {
    for (double off_deg = 0.0; off_deg <= 180.0; off_deg += 0.25) {
      EarthInFrame earth = earth_at(500.0, off_deg, 30.0);
      earth.air.optical_depth = air;
      background.draw(earth, 0.0);
      double most = 0;
      for (int v = 0; v < 256; v += 15)
        for (int u = 0; u < 256; u += 15) most = std::max(most, background.at({1.0 * u, 1.0 * v}));
      EXPECT_EQ(background.empty(), most <= 0.0) << off_deg;
    }
  }
  background.draw(earth_at(-1.0, 0.0, 30.0), 0.0);  // from inside
  EXPECT_TRUE(background.empty());
  background.draw({}, 0.0);
  EXPECT_TRUE(background.empty());
  std::vector<float> row(256, 1.0F);
  background.add_row(10, 0, 1.0F, row);
  EXPECT_TRUE(std::ranges::all_of(row, [](float x) { return x == 1.0F; }));
}

TEST(EarthBackground, SeenWholeItIsALambertSpheresPhaseFunction) {
  // Russell 1916: 2/3 a (R/r)^2 (sin p + (pi - p) cos p) / pi. Also when it is smaller than a
  // block.
  for (const double distance_radii : {60.0, 600.0}) {
    for (const double phase_deg : {0.0, 60.0, 100.0}) {
      EarthBackground background;
      const CameraGeometry camera = camera_of(0.01);
      background.reserve(camera, 0);
      EarthInFrame earth = earth_at(1.0, 0.0, phase_deg);
      earth.disc.distance_radii = distance_radii;
      earth.air.optical_depth = 0.0;
      background.draw(earth, 0.0);
      double flux = 0;
      for (int v = 0; v < 256; ++v) {
        std::vector<float> row(256, 0.0F);
        background.add_row(v, 0, 1.0F, row);
        for (int u = 0; u < 256; ++u)
          flux += static_cast<double>(row[static_cast<std::size_t>(u)]) *
                  std::pow(camera.ifov_rad(), 2);
      }
      const double p = phase_deg * kDegree;
      const double want = kSun_w_m2 * 2.0 / 3.0 * 0.3 / std::pow(distance_radii, 2) *
                          (std::sin(p) + (kPi - p) * std::cos(p)) / kPi;
      // 9 samples a pixel leave sqrt(edge) / 9 of a pixel's light at random: of 2000 and 20 px in
      // the disc .5 and 7 %, half of it at an average edge. The Earth's own size is R/r.
      const double tolerance = distance_radii > 100.0 ? 0.07 : 0.01 + 1.0 / distance_radii;
      EXPECT_NEAR(flux / want, 1.0, tolerance) << distance_radii << " " << phase_deg;
    }
  }
}

TEST(EarthBackground, TheAirFadesByItsScaleHeightAboveTheLimb) {
  EarthInFrame earth = earth_at(500.0, 0.0, 40.0);
  earth = earth_at(500.0, limb_deg(earth), 40.0);
  EarthBackground background;
  const CameraGeometry camera = camera_of(0.3);
  background.reserve(camera, 0);
  background.draw(earth, 0.0);
  const auto above_limb = [&](double height_m) {
    const double r_m = earth.disc.distance_radii * kEarthRadius_m;
    const double off =
        std::asin((kEarthRadius_m + height_m) / r_m) - std::asin(kEarthRadius_m / r_m);
    return background.at({128.0, 128.0 - std::tan(off) * camera.pixels_per_radian()});
  };
  // No step at the limb but for the 8e-4 that the longest chord lets through.
  const double tau = 0.077 * std::sqrt(2.0 * kPi * kEarthRadius_m / 8000.0);
  EXPECT_NEAR(above_limb(1e-3) / above_limb(-1e-3), 1.0 - std::exp(-tau), 1e-4);
  // Thin air is as bright as it is deep.
  EXPECT_NEAR(above_limb(56e3) / above_limb(48e3), std::exp(-1.0), 0.01);
  EXPECT_EQ(above_limb(200e3), 0.0);
  earth.air.optical_depth = 0.0;
  background.draw(earth, 0.0);
  EXPECT_EQ(above_limb(1.0), 0.0);
  EXPECT_GT(above_limb(-1.0), 1.0);
}

TEST(EarthBackground, TheDarkEarthHidesTheSky) {
  EarthBackground background;
  background.reserve(camera_of(4.5), 0);
  background.draw(earth_at(500.0, 0.0, 150.0), 2.5);
  std::vector<float> row(256, 2.5F);
  background.add_row(100, 0, 1.0F, row);
  for (const float x : row) EXPECT_NEAR(x, 0.0F, 1e-6F);
}

TEST(EarthBackground, TheTerminatorIsAsWideAsTheSun) {
  // The ground's brightness along a line through the terminator, the Sun's height by the place.
  for (const double height_deg : {-1.0, -0.28, 0.0, 0.28, 1.0}) {
    EarthBackground background;
    background.reserve(camera_of(4.5), 0);
    background.draw(earth_at(500.0, 0.0, 90.0 - height_deg), 0.0);
    const double share = background.at({128.0, 128.0}) / (0.3 * kSun_w_m2 / kPi);
    if (height_deg < -0.27) {
      EXPECT_EQ(share, 0.0);
    } else if (height_deg == 0.0) {
      // A square disc, half risen: a quarter of its half width.
      EXPECT_NEAR(share, kSunAngularRadius_rad / 4.0, 1e-12);
    } else {
      EXPECT_NEAR(share, std::sin(height_deg * kDegree), 1e-12);
    }
  }
}

}  // namespace
}  // namespace engine
