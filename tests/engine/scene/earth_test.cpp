#include "engine/scene/earth.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/csv.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;

constexpr double kPaperSun_w_m2 = 634.64;
constexpr double kAlbedo = 0.3;
const Position<J2000> kAt420km{{0.0, 0.0, kEarthRadius_m + 420e3}};

Direction<J2000> sun_at(double zenith_deg) {
  return {{std::sin(zenith_deg * kDegree), 0.0, std::cos(zenith_deg * kDegree)}};
}

TEST(Earthshine, AgreesWithTheReferenceIntegral) {
  const Csv reference("earthshine_alt420.csv");
  for (const Csv::Row& row : reference.rows()) {
    const double zenith_deg = row.number("solar_zenith_at_subtarget_deg");
    const Vector3d light = earthshine_vector(kAt420km, sun_at(zenith_deg), kAlbedo, kPaperSun_w_m2);
    const double want = row.number("vector_irradiance_W_m2");
    // The model's .2 %; six decimals are printed.
    EXPECT_NEAR(light.norm(), want, 0.002 * want + 1e-6) << zenith_deg;
    const double want_nadir = row.number("E_nadir_facet_W_m2");
    EXPECT_NEAR(-light.z(), want_nadir, 0.002 * want + 1e-6) << zenith_deg;
    EXPECT_NEAR(light.y(), 0.0, 1e-12 * kPaperSun_w_m2);
    if (want > 0.0) {
      // A light that is wrong by .2 % of its length turns by .11 deg at most.
      const double angle_deg = std::atan2(light.x(), -light.z()) / kDegree;
      EXPECT_NEAR(angle_deg, row.number("vector_angle_from_nadir_toward_sun_deg"), 0.12);
    }
  }
}

TEST(Earthshine, FallsWithTheSunAsTheStabilityTableSays) {
  struct Share {
    double zenith_deg;
    double of_sun;
    double tolerance;
  };
  // Four decimals are printed: 1 %, or half of the last of them.
  for (const Share& s :
       {Share{0, 0.2629, 0.0026}, Share{30, 0.2277, 0.0023}, Share{60, 0.1314, 0.0013},
        Share{80, 0.0458, 0.0005}, Share{90, 0.0063, 0.0001}, Share{100, 0.0001, 0.00005}}) {
    const Vector3d light = earthshine_vector(kAt420km, sun_at(s.zenith_deg), kAlbedo, 1.0);
    EXPECT_NEAR(-light.z(), s.of_sun, s.tolerance) << s.zenith_deg;
  }
}

TEST(Earthshine, IsZeroAtNight) {
  for (const double zenith_deg : {110.0, 150.0, 180.0})
    EXPECT_EQ(earthshine_vector(kAt420km, sun_at(zenith_deg), kAlbedo, kPaperSun_w_m2).norm(), 0.0);
}

TEST(Earthshine, FromFarAwayIsALambertSpheresPhaseFunction) {
  // Russell 1916: 2/3 a (R/r)^2 (sin p + (pi - p) cos p) / pi.
  const double r = 2000.0;
  const Position<J2000> far{{0.0, 0.0, r * kEarthRadius_m}};
  for (const double phase_deg : {0.0, 30.0, 60.0, 90.0, 120.0}) {
    const double p = phase_deg * kDegree;
    const double want =
        2.0 / 3.0 * kAlbedo / (r * r) * (std::sin(p) + (kPi - p) * std::cos(p)) / kPi;
    const double got = earthshine_vector(far, sun_at(phase_deg), kAlbedo, 1.0).norm();
    EXPECT_NEAR(got / want, 1.0, 0.002 + 1.0 / r) << phase_deg;  // and the Earth's size, R/r
  }
}

TEST(Earthshine, DoesNotDependOnTheFrame) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.234, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const double zenith_deg : {0.0, 45.0, 95.0}) {
    const Direction<J2000> sun = sun_at(zenith_deg);
    const Vector3d a = turn * earthshine_vector(kAt420km, sun, kAlbedo, 1.0);
    const Vector3d b = earthshine_vector({turn * kAt420km.m}, {turn * sun.unit}, kAlbedo, 1.0);
    // At the zenith the ring's zero turns freely: sectors sum up to zero all the same.
    EXPECT_LT((a - b).norm(), 1e-12) << zenith_deg;
  }
}

TEST(Earthshine, GrowsWithAlbedoAndSun) {
  const Vector3d once = earthshine_vector(kAt420km, sun_at(50.0), 0.2, 100.0);
  const Vector3d six = earthshine_vector(kAt420km, sun_at(50.0), 0.6, 200.0);
  EXPECT_LT((six - 6.0 * once).norm(), 1e-13 * six.norm());
  EXPECT_EQ(earthshine_vector(kAt420km, sun_at(50.0), 0.0, 100.0).norm(), 0.0);
}

TEST(Earthshine, IsFiniteOnTheGround) {
  for (const double height_m : {-1.0, 0.0, 1e-3, 1.0}) {
    const Position<J2000> low{{0.0, 0.0, kEarthRadius_m + height_m}};
    const Vector3d light = earthshine_vector(low, sun_at(0.0), kAlbedo, 1.0);
    EXPECT_TRUE(light.allFinite()) << height_m;
    EXPECT_LE(light.norm(), kAlbedo * 1.001) << height_m;
  }
}

TEST(PaperEarthLamp, ShinesFromTheNadirWhateverTheSunDoes) {
  const Vector3d light = paper_earth_lamp(kAt420km, kAlbedo, kPaperSun_w_m2);
  EXPECT_NEAR(light.norm(), 190.39, 0.005);  // as printed in the paper
  EXPECT_NEAR(light.z(), -light.norm(), 1e-12);
}

TEST(ReadEarth, KnowsItsModels) {
  const auto read = [](const std::string& text) {
    const ConfigReader config = ConfigReader::from_text("[earth]\n" + text, "x.toml");
    return read_earth(config.table("earth"));
  };
  EXPECT_EQ(read("").earthshine, EarthshineModel::kVector);
  EXPECT_EQ(read("earthshine = \"none\"").earthshine, EarthshineModel::kNone);
  EXPECT_EQ(read("earthshine = \"paper-lamp\"").earthshine, EarthshineModel::kPaperLamp);
  EXPECT_THROW(read("earthshine = \"some\""), ConfigError);
  EXPECT_THROW(read("albedo = 1.1"), ConfigError);
}

}  // namespace
}  // namespace engine
