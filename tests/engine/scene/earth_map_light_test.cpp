#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"
#include "engine/orbit/utc.h"
#include "engine/scene/earth.h"
#include "engine/scene/earth_light.h"
#include "engine/scene/snapshot_builder.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Moments;

/// A place over the ground and the Sun's zenith distance there; the axes are the ground's.
struct Over {
  const char* name;
  double north_deg;
  double east_deg;
  double height_km;
  double zenith_deg;
};

const std::vector<Over> kPlaces = {
    {"mid Pacific", -10, -140, 420, 20}, {"Sahara", 23, 10, 420, 60},
    {"Europe", 48, 10, 420, 85},         {"Amazon's mouth", 0, -48, 420, 0},
    {"Greenland", 70, -40, 800, 75},     {"Red Sea", 22, 38, 420, 93},
    {"date line", 5, 180, 1200, 40},     {"north pole", 89.9, 0, 600, 80},
    {"south pole", -90, 0, 600, 70},     {"Africa from afar", 5, 20, 36000, 30},
    {"crescent", 0, 0, 36000, 120}};

Vector3d ground(double north_deg, double east_deg) {
  const double lat = north_deg * kDegree;
  const double lon = east_deg * kDegree;
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

EarthDisc<BodyFrame> disc_over(const Over& over, double azimuth_deg = 30.0) {
  const Vector3d up = ground(over.north_deg, over.east_deg);
  const Vector3d side =
      Eigen::AngleAxisd(azimuth_deg * kDegree, up) * Vector3d(up.unitOrthogonal());
  EarthDisc<BodyFrame> disc;
  disc.to_centre.unit = -up;
  disc.to_sun.unit =
      std::cos(over.zenith_deg * kDegree) * up + std::sin(over.zenith_deg * kDegree) * side;
  disc.north.unit = Vector3d::UnitZ();
  disc.greenwich.unit = Vector3d::UnitX();
  disc.distance_radii = 1.0 + over.height_km * 1e3 / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = 634.64;
  disc.albedo = {{0.34, 0.05, 0.29}};
  disc.albedo_by_place = true;
  return disc;
}

/// Of the integrals, in shares of the scalar irradiance: see EarthLight.
double stated_error(double height_km) {
  return height_km <= 800.0 ? 0.003 : height_km <= 2000.0 ? 0.013 : 0.024;
}

/// Calls visit(direction, solid angle) for midpoints of the cap's directions, denser at the limb.
template <class Visit>
void over_cap(const EarthDisc<BodyFrame>& disc, int rings, int sectors, const Visit& visit) {
  const Vector3d across = disc.to_centre.unit.unitOrthogonal();
  const Vector3d beside = disc.to_centre.unit.cross(across);
  const double cos_limb = std::sqrt(1.0 - 1.0 / (disc.distance_radii * disc.distance_radii));
  for (int i = 0; i < rings; ++i) {
    const double s = (i + 0.5) / rings;
    const double c = 1.0 - (1.0 - cos_limb) * s * (2.0 - s);
    const double sr = (1.0 - cos_limb) * 2.0 * (1.0 - s) / rings * 2.0 * kPi / sectors;
    const double sine = std::sqrt(1.0 - c * c);
    for (int j = 0; j < sectors; ++j) {
      const double a = 2.0 * kPi * (j + 0.5) / sectors;
      visit(sine * (std::cos(a) * across + std::sin(a) * beside) + c * disc.to_centre.unit, sr);
    }
  }
}

TEST(EarthMapLight, MomentsAreThoseOfTheCapSummedUpByHand) {
  for (const Over& over : kPlaces) {
    SCOPED_TRACE(over.name);
    const EarthDisc<BodyFrame> disc = disc_over(over);
    EarthDisc<BodyFrame> zonal = disc;
    zonal.albedo_by_place = false;
    const EarthLight light(disc);
    const Vector3d normal = (disc.to_centre.unit + 0.5 * disc.to_sun.unit).normalized();
    double scalar = 0;
    double moved = 0;
    Vector3d vector = Vector3d::Zero();
    double harmonics = 0;
    over_cap(disc, 400, 400, [&](const Vector3d& d, double sr) {
      const double l = disc.radiance_w_m2_sr(d) * sr;
      const double c = d.dot(normal);
      scalar += l;
      vector += l * d;
      harmonics += l * (3.0 / 32.0 + 0.5 * c + 15.0 / 32.0 * c * c);
      moved += std::abs(l - zonal.radiance_w_m2_sr(d) * sr);
    });
    // As stated; midpoints leave 1/400^2, and of a narrow lit part ten times that.
    const double tolerance = (stated_error(over.height_km) + 1e-4) * scalar;
    EXPECT_NEAR(light.scalar_irradiance_w_m2(), scalar, tolerance);
    EXPECT_LT((light.vector_irradiance_w_m2() - vector).norm(), tolerance);
    EXPECT_NEAR(light.irradiance_w_m2(normal), harmonics, 1.07 * tolerance);
    EXPECT_NEAR(light.moved_by_map_w_m2(), moved, tolerance);
    // It is not the zonal light: here the map moves .6 to 19 % of it.
    EXPECT_GT(moved, 0.005 * scalar);
    EXPECT_EQ(EarthLight(zonal).moved_by_map_w_m2(), 0.0);
  }
}

TEST(EarthMapLight, MomentsAreAsGoodAnywhere) {
  Draws draws(3, Stream::kLight, 0, 0);
  for (const double height_km : {300.0, 800.0, 2000.0, 36000.0}) {
    for (int i = 0; i < 15; ++i) {
      const Over over{"", std::asin(2 * draws.uniform_double() - 1) / kDegree,
                      360 * draws.uniform_double(), height_km, 100 * draws.uniform_double()};
      const EarthLight light(disc_over(over, 360 * draws.uniform_double()));
      double scalar = 0;
      Vector3d vector = Vector3d::Zero();
      over_cap(light.disc(), 200, 200, [&](const Vector3d& d, double sr) {
        const double l = light.radiance_w_m2_sr(d) * sr;
        scalar += l;
        vector += l * d;
      });
      EXPECT_LT((light.vector_irradiance_w_m2() - vector).norm(),
                stated_error(height_km) * scalar + 1e-6)
          << height_km << " km over " << over.north_deg << " " << over.east_deg;
    }
  }
}

TEST(EarthMapLight, SamplesAddUpToTheCap) {
  for (const Over& over : kPlaces) {
    SCOPED_TRACE(over.name);
    const EarthLight light(disc_over(over));
    double scalar = 0;
    over_cap(light.disc(), 400, 400,
             [&](const Vector3d& d, double sr) { scalar += light.radiance_w_m2_sr(d) * sr; });
    Moments sampled;
    Draws draws(7, Stream::kLight, 0, 0);
    for (int i = 0; i < 20000; ++i) {
      const EarthLight::Sample s = light.sample(draws.uniform_double(), draws.uniform_double());
      ASSERT_GT(s.pdf, 0.0);
      EXPECT_LE(s.radiance_w_m2_sr, light.largest_radiance_w_m2_sr());
      // The limb's square root takes half of the digits.
      EXPECT_NEAR(light.radiance_w_m2_sr(s.direction), s.radiance_w_m2_sr,
                  1e-5 * light.largest_radiance_w_m2_sr());
      sampled.add(s.radiance_w_m2_sr / s.pdf);
    }
    EXPECT_NEAR(sampled.mean(), scalar, 3.0 * sampled.sigma_of_mean());
  }
}

TEST(EarthMapLight, TheNightSideSendsNothing) {
  for (const Over& over : kPlaces) {
    const EarthDisc<BodyFrame> disc = disc_over(over);
    int dark = 0;
    over_cap(disc, 50, 50, [&](const Vector3d& d, double) {
      const Vector3d vertical = disc.vertical_at(d, disc.passes_at_radii(d));
      const bool night = vertical.dot(disc.to_sun.unit) <= 0.0;
      EXPECT_EQ(disc.radiance_w_m2_sr(d) > 0.0, !night) << over.name;
      dark += night ? 1 : 0;
    });
    if (over.zenith_deg > 90.0) {
      EXPECT_GT(dark, 0) << over.name;
    }
  }
  EXPECT_TRUE(EarthLight(disc_over({"night", 24, 10, 420, 150})).dark());
}

TEST(EarthMapLight, DoesNotDependOnTheFrame) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.234, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const Over& over : kPlaces) {
    const EarthDisc<BodyFrame> disc = disc_over(over);
    EarthDisc<BodyFrame> turned = disc;
    turned.to_centre.unit = turn * disc.to_centre.unit;
    turned.to_sun.unit = turn * disc.to_sun.unit;
    turned.north.unit = turn * disc.north.unit;
    turned.greenwich.unit = turn * disc.greenwich.unit;
    const Vector3d a = turn * EarthLight(disc).vector_irradiance_w_m2();
    const Vector3d b = EarthLight(turned).vector_irradiance_w_m2();
    // With the Sun in the zenith the nodes' first azimuth is anything: the stated error.
    EXPECT_LT((a - b).norm(),
              (over.zenith_deg > 0.0 ? 1e-11 : stated_error(over.height_km)) * a.norm())
        << over.name;
  }
}

TEST(EarthMapChoice, LeavesTheMapOutWhereTheSensorCannotSeeItAndSaysBy) {
  EarthDisc<BodyFrame> disc = disc_over(kPlaces[1]);
  const EarthLight mapped(disc);
  disc.albedo_by_place = false;
  const EarthLight zonal(disc);
  EarthshineSensor sensor;
  sensor.dark_variance_e2 = 22.0;
  sensor.diffuse_albedo = 0.5;
  sensor.glossy_albedo = 0.0;
  int left_out = 0;
  int kept = 0;
  for (double e = 1e-3; e < 1e9; e *= 1.2) {
    sensor.e_per_radiance = e;
    const EarthshineChoice choice = choose_earthshine(EarthshineModel::kAuto, mapped, sensor);
    const double noise_e = std::sqrt(22.0 + e * 0.5 / kPi * mapped.scalar_irradiance_w_m2());
    EXPECT_LE(choice.error_e + choice.albedo_error_e, 0.3 * noise_e);
    if (choice.model == EarthshineModel::kNone) continue;
    if (choice.albedo == AlbedoModel::kMap) {
      ++kept;
      EXPECT_EQ(choice.albedo_error_e, 0.0);
      continue;
    }
    ++left_out;
    EXPECT_EQ(choice.albedo, AlbedoModel::kZonal);
    // What a facet of any tilt would get less or more.
    for (int i = 0; i < 50; ++i) {
      const Vector3d n = ground(-90.0 + 3.6 * i, 77.0 * i);
      const double moved = mapped.irradiance_w_m2(n) - zonal.irradiance_w_m2(n);
      EXPECT_LE(std::abs(moved) * e * 0.5 / kPi, choice.albedo_error_e);
    }
  }
  EXPECT_GT(left_out, 2);
  EXPECT_GT(kept, 10);
  // What is asked for is kept, and without a sensor nothing is left out.
  sensor.e_per_radiance = 1e-3;
  EXPECT_EQ(choose_earthshine(EarthshineModel::kVector, mapped, sensor).albedo, AlbedoModel::kMap);
  EXPECT_EQ(choose_earthshine(EarthshineModel::kAuto, mapped, {}).albedo, AlbedoModel::kMap);
}

/// A satellite that stays where it is.
class Standing : public Propagator {
 public:
  explicit Standing(const Position<J2000>& place) : place_(place) {}
  [[nodiscard]] OrbitState at(Epoch) const noexcept override {
    return {place_, {7600.0 * place_.m.unitOrthogonal()}};
  }

 private:
  Position<J2000> place_;
};

TEST(EarthMapInSnapshots, TheGroundTurnsBelowAsTheClockSays) {
  // Where the Sun stands in the zenith at the solstice, by the equation of time, -1.8 min: at
  // 11:13 UTC over 12.2 deg east, the Sahara; at 15:02 over 45 deg west, the Atlantic; and both
  // times 23.4 deg north. A satellite below the Sun sees them right below itself.
  const auto below = [](const char* utc, EarthshineModel rung) {
    SceneSpec spec;
    spec.epoch = epoch_from_utc(utc).value();
    spec.earth.albedo_model = AlbedoModel::kMap;
    spec.earth.earthshine = rung;
    const Vector3d to_sun = sun_position(SunModel::kErfa, spec.epoch).m.normalized();
    const Standing target({(kEarthRadius_m + 420e3) * to_sun});
    const Standing camera({(kEarthRadius_m + 430e3) * to_sun});
    Shot shot;
    shot.exposure = from_seconds(1e-3);
    return SnapshotBuilder(spec, camera, target).build(shot);
  };
  const Snapshot sahara = below("2022-06-21T11:13:00", EarthshineModel::kCap);
  const Snapshot atlantic = below("2022-06-21T15:02:00", EarthshineModel::kCap);
  for (const Snapshot* s : {&sahara, &atlantic}) {
    const EarthDisc<BodyFrame>& disc = s->earth.disc();
    const EarthDisc<CameraFrame>& seen = s->earth_in_frame.disc;
    EXPECT_NEAR(std::asin(-disc.to_centre.unit.dot(disc.north.unit)) / kDegree, 23.4, 0.2);
    EXPECT_NEAR(seen.albedo_at(-seen.to_centre.unit), disc.albedo_at(-disc.to_centre.unit), 1e-9);
    EXPECT_EQ(s->earthshine_rung.albedo, AlbedoModel::kMap);
  }
  const EarthDisc<BodyFrame>& dry = sahara.earth.disc();
  const EarthDisc<BodyFrame>& wet = atlantic.earth.disc();
  EXPECT_GT(dry.albedo_at(-dry.to_centre.unit), 0.3);
  EXPECT_LT(wet.albedo_at(-wet.to_centre.unit), 0.25);
  EXPECT_GT(sahara.earthshine.irradiance_w_m2, 1.2 * atlantic.earthshine.irradiance_w_m2);
  const EarthDisc<CameraFrame>& frame = sahara.earth_in_frame.disc;
  const double east_deg =
      std::atan2(-frame.to_centre.unit.dot(frame.north.unit.cross(frame.greenwich.unit)),
                 -frame.to_centre.unit.dot(frame.greenwich.unit)) /
      kDegree;
  EXPECT_NEAR(east_deg, 12.2, 0.3);
}

}  // namespace
}  // namespace engine
