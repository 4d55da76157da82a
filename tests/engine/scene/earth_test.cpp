#include "engine/scene/earth.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/utc.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kPaperSun_w_m2 = 634.64;
constexpr double kAlbedo = 0.3;
const Position<J2000> kAt420km{{0.0, 0.0, kEarthRadius_m + 420e3}};

Direction<J2000> sun_at(double zenith_deg) {
  return {{std::sin(zenith_deg * kDegree), 0.0, std::cos(zenith_deg * kDegree)}};
}

/// The nadir along -z.
Vector3d earthshine_vector(const Position<J2000>& target, const Direction<J2000>& to_sun,
                           double albedo, double sun_irradiance) {
  EarthDisc<BodyFrame> disc;
  disc.to_centre.unit = -target.m.normalized();
  disc.to_sun.unit = to_sun.unit;
  disc.distance_radii = target.m.norm() / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = sun_irradiance;
  disc.albedo = {{albedo, 0.0, 0.0}};
  return EarthLight(disc).vector_irradiance_w_m2();
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

EarthLight light_at(double zenith_deg) {
  EarthDisc<BodyFrame> disc;
  disc.to_sun.unit = {std::sin(zenith_deg * kDegree), 0.0, -std::cos(zenith_deg * kDegree)};
  disc.distance_radii = kAt420km.m.norm() / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = 1.0;
  return EarthLight(disc);
}

TEST(EarthshineChoice, RisesFromNoneToTheCapWithTheExposureAndSaysWhatItAccepts) {
  const EarthLight light = light_at(60.0);
  EarthshineSensor sensor;
  sensor.dark_variance_e2 = 22.0;
  sensor.diffuse_albedo = 0.5;
  sensor.glossy_albedo = 0.0;
  std::vector<EarthshineModel> seen;
  for (double e = 1e-3; e < 1e9; e *= 1.5) {
    sensor.e_per_radiance = e;
    const EarthshineChoice choice = choose_earthshine(EarthshineModel::kAuto, light, sensor);
    if (seen.empty() || seen.back() != choice.model) seen.push_back(choice.model);
    // A diffuse surface: what it gets with the rung instead of the cap, over its noise with it.
    const double all_e = e * 0.5 / kPi * light.scalar_irradiance_w_m2();
    const double lost_e = choice.model == EarthshineModel::kNone
                              ? e * 0.5 / kPi * light.vector_irradiance_w_m2().norm()
                          : choice.model == EarthshineModel::kHarmonics ? all_e * 3.0 / 32.0
                                                                        : 0.0;
    EXPECT_LE(lost_e, choice.error_e * (1.0 + 1e-12));
    EXPECT_LE(choice.error_e, 0.3 * std::sqrt(22.0 + all_e));
  }
  EXPECT_EQ(seen, (std::vector{EarthshineModel::kNone, EarthshineModel::kHarmonics,
                               EarthshineModel::kCap}));
}

TEST(EarthshineChoice, HarmonicsAnswerForWhatTheyLeaveOfAMirrorsLight) {
  EarthshineSensor sensor;
  sensor.dark_variance_e2 = 22.0;
  const EarthLight light = light_at(60.0);
  int left_out = 0;
  for (double e = 1e-3; e < 1e6; e *= 1.1) {
    sensor.e_per_radiance = e;
    const EarthshineChoice choice = choose_earthshine(EarthshineModel::kAuto, light, sensor);
    if (choice.model == EarthshineModel::kCap) continue;
    ++left_out;
    EXPECT_GE(choice.error_e, e * light.largest_radiance_w_m2_sr());
  }
  EXPECT_GT(left_out, 10);
}

TEST(EarthshineChoice, WithoutASensorItIsTheCapAndAtNightNothing) {
  EXPECT_EQ(choose_earthshine(EarthshineModel::kAuto, light_at(60.0), {}).model,
            EarthshineModel::kCap);
  const EarthshineChoice night = choose_earthshine(EarthshineModel::kAuto, light_at(140.0), {});
  EXPECT_EQ(night.model, EarthshineModel::kNone);
  EXPECT_EQ(night.error_e, 0.0);
}

TEST(EarthshineChoice, WhatIsAskedForIsKeptAndItsErrorSaid) {
  EarthshineSensor sensor;
  sensor.e_per_radiance = 267.0;
  const EarthLight light = light_at(60.0);
  for (const EarthshineModel model : {EarthshineModel::kNone, EarthshineModel::kVector,
                                      EarthshineModel::kHarmonics, EarthshineModel::kCap}) {
    const EarthshineChoice choice = choose_earthshine(model, light, sensor);
    EXPECT_EQ(choice.model, model);
    EXPECT_EQ(choice.error_e > 0.0, model != EarthshineModel::kCap);
  }
  EXPECT_TRUE(std::isnan(choose_earthshine(EarthshineModel::kPaperLamp, {}, sensor).error_e));
}

TEST(ZonalAlbedoOfDate, IsThatOfKnockeAndOthers) {
  // ECSS-E-ST-10-04C, annex F: .34, .10 cos(2 pi (t - 1981-12-22) / 365.25 d), .29.
  const ZonalAlbedo winter = zonal_albedo(epoch_from_utc("1981-12-22T00:00:00").value());
  EXPECT_NEAR(winter.at(0.0), 0.34 - 0.145, 1e-6);
  EXPECT_NEAR(winter.at(1.0), 0.34 + 0.10 + 0.29, 1e-6);
  EXPECT_NEAR(winter.at(-1.0), 0.34 - 0.10 + 0.29, 1e-6);
  // Half a year later the hemispheres have changed places; a day is 1e-4 of a cosine's top.
  const ZonalAlbedo summer = zonal_albedo(epoch_from_utc("2022-06-22T12:00:00").value());
  EXPECT_NEAR(summer.at(1.0), winter.at(-1.0), 1e-4);
  EXPECT_NEAR(summer.at(-0.5), winter.at(0.5), 1e-4);
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
  EXPECT_EQ(read("").earthshine, EarthshineModel::kAuto);
  EXPECT_EQ(read("earthshine = \"none\"").earthshine, EarthshineModel::kNone);
  EXPECT_EQ(read("earthshine = \"paper-lamp\"").earthshine, EarthshineModel::kPaperLamp);
  for (const EarthshineModel model : {EarthshineModel::kVector, EarthshineModel::kHarmonics,
                                      EarthshineModel::kCap, EarthshineModel::kAuto})
    EXPECT_EQ(read("earthshine = \"" + std::string(name_of(model)) + "\"").earthshine, model);
  EXPECT_EQ(read("albedo = 0.2").albedo_model, AlbedoModel::kEven);
  for (const AlbedoModel model : {AlbedoModel::kZonal, AlbedoModel::kMap})
    EXPECT_EQ(read("albedo = \"" + std::string(name_of(model)) + "\"").albedo_model, model);
  EXPECT_TRUE(read("").in_frame);
  EXPECT_FALSE(read("in_frame = \"no\"").in_frame);
  EXPECT_EQ(read("air_optical_depth = 0.0").air.optical_depth, 0.0);
  EXPECT_THROW(read("earthshine = \"some\""), ConfigError);
  EXPECT_THROW(read("albedo = \"some\""), ConfigError);
  EXPECT_THROW(read("in_frame = \"yes\""), ConfigError);
  EXPECT_THROW(read("air_optical_depth = -1.0"), ConfigError);
  EXPECT_THROW(read("albedo = 1.1"), ConfigError);
}

}  // namespace
}  // namespace engine
