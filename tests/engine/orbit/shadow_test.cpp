#include "engine/orbit/shadow.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Flyby;

constexpr double kSunRadius_m = 6.957e8;
constexpr double kFlattening = 1.0 / 298.257;

/// On the ecliptic, at 1 au.
Position<J2000> sun_at(double longitude_deg) {
  const double lon = longitude_deg * kDegree;
  const double obliquity = 23.44 * kDegree;
  return {kAstronomicalUnit_m * Vector3d(std::cos(lon), std::sin(lon) * std::cos(obliquity),
                                         std::sin(lon) * std::sin(obliquity))};
}

/// The first time in [from, to] at which something changes, to a microsecond.
template <class Predicate>
double change_s(const Predicate& holds, double from_s, double to_s) {
  const bool at_first = holds(from_s);
  EXPECT_NE(holds(to_s), at_first);
  while (to_s - from_s > 1e-6) {
    const double middle_s = 0.5 * (from_s + to_s);
    (holds(middle_s) == at_first ? from_s : to_s) = middle_s;
  }
  return to_s;
}

/// Whether a ray meets the ellipsoid, by the discriminant of its quadratic.
bool meets_earth(const Vector3d& from, const Vector3d& along, double flattening) {
  const Vector3d stretch(1.0, 1.0, 1.0 / (1.0 - flattening));
  const Vector3d a = from.cwiseProduct(stretch);
  const Vector3d d = along.cwiseProduct(stretch);
  const double b = a.dot(d);
  return b < 0.0 && b * b > d.squaredNorm() * (a.squaredNorm() - kEarthRadius_m * kEarthRadius_m);
}

/// By as many places on the Sun's disc, spread evenly.
double counted_lit_fraction(const Vector3d& body, const Vector3d& sun, double flattening) {
  constexpr int kPlaces = 20000;
  const Vector3d z = (sun - body).normalized();
  const Vector3d x = z.unitOrthogonal();
  const Vector3d y = z.cross(x);
  // The limb is where rays touch the ball: the disc is a little smaller than it, and nearer.
  const double distance_m = (sun - body).norm();
  const double tan = std::tan(std::asin(kSunRadius_m / distance_m));
  int seen = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double r = tan * std::sqrt((i + 0.5) / kPlaces);
    const double turn = i * 2.399963229728653;  // the golden angle
    const Vector3d ray = z + r * (std::cos(turn) * x + std::sin(turn) * y);
    seen += meets_earth(body, ray, flattening) ? 0 : 1;
  }
  return static_cast<double>(seen) / kPlaces;
}

TEST(Shadow, IsTheCylinderOfTable2) {
  const Position<J2000> sun{{kAstronomicalUnit_m, 0, 0}};
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> along(-5e7, 5e7);
  for (int i = 0; i < 100000; ++i) {
    const Vector3d body(along(random), 0.3 * along(random), 0.3 * along(random));
    if (body.norm() < kEarthRadius_m + 1e3) continue;
    const double gamma = angle_between_rad(body, sun.m);
    const double off_axis_m = body.norm() * std::sin(gamma);
    if (std::abs(off_axis_m - kEarthRadius_m) < 1.0) continue;
    const bool lit = gamma <= kPi / 2.0 || off_axis_m > kEarthRadius_m;
    ASSERT_EQ(shadow_margin_m(ShadowModel::kCylinder, {body}, sun) > 0.0, lit) << body.transpose();
    ASSERT_EQ(lit_fraction(ShadowModel::kCylinder, {body}, sun), lit ? 1.0 : 0.0);
  }
}

struct Golden {
  bool of_camera;
  double from_s, to_s;          ///< a time in sunlight, and one in the umbra
  double cylinder_s, oblate_s;  ///< of a point Sun
  double full_s, none_s;        ///< all of the Sun's disc is seen, and none, past a round Earth
};

// Computed independently for this project: the orbits of table 5, the Sun at longitude 240 deg.
const std::vector<Golden> kGolden = {
    {true, 1800, 2500, 1941.36, 1949.23, 1936.36, 1946.27},
    {true, 4100, 3500, 3953.90, 3948.85, 3958.91, 3948.99},
    {false, 2800, 3500, 2970.86, 2974.79, 2966.69, 2974.94},
    {false, 5300, 4500, 5132.89, 5128.88, 5137.05, 5128.81},
};

class ShadowEdges : public testing::TestWithParam<Golden> {
 protected:
  [[nodiscard]] Position<J2000> body(double t_s) const {
    const Propagator& moving = GetParam().of_camera ? static_cast<const Propagator&>(flyby_.camera)
                                                    : static_cast<const Propagator&>(flyby_.target);
    return moving.at(flyby_.at(t_s)).position;
  }
  [[nodiscard]] double lit(ShadowModel model, double t_s) const {
    return lit_fraction(model, body(t_s), sun_);
  }
  template <class Predicate>
  [[nodiscard]] double edge_s(const Predicate& holds) const {
    const double from_s = std::min(GetParam().from_s, GetParam().to_s);
    return change_s(holds, from_s, std::max(GetParam().from_s, GetParam().to_s));
  }

  Flyby flyby_;
  Position<J2000> sun_ = sun_at(240.0);
};

// Two decimals are printed. Flattened, and of discs, the reference is good to .05 s.
constexpr double kGolden_s = 0.006;

TEST_P(ShadowEdges, OfACylinder) {
  EXPECT_NEAR(edge_s([&](double t_s) { return lit(ShadowModel::kCylinder, t_s) > 0.0; }),
              GetParam().cylinder_s, kGolden_s);
}

TEST_P(ShadowEdges, OfACylinderBehindTheFlattenedEarth) {
  const auto lit_by_point = [&](double t_s) {
    return shadow_margin_m(ShadowModel::kCylinder, earth_made_round(body(t_s)),
                           earth_made_round(sun_)) > 0.0;
  };
  EXPECT_NEAR(edge_s(lit_by_point), GetParam().oblate_s, 0.05);
  // Stretching axes is the same as cutting an ellipsoid.
  const auto sees_point = [&](double t_s) {
    return !meets_earth(body(t_s).m, sun_.m, kFlattening);
  };
  EXPECT_NEAR(edge_s(lit_by_point), edge_s(sees_point), 2e-6);
}

TEST_P(ShadowEdges, OfAPenumbra) {
  EXPECT_NEAR(edge_s([&](double t_s) { return lit(ShadowModel::kCone, t_s) < 1.0; }),
              GetParam().full_s, 0.05);
  EXPECT_NEAR(edge_s([&](double t_s) { return lit(ShadowModel::kCone, t_s) > 0.0; }),
              GetParam().none_s, 0.05);
}

TEST_P(ShadowEdges, FadeEvenlyAndHalfOfTheLightGoesInHalfTheTime) {
  for (const ShadowModel model : {ShadowModel::kCone, ShadowModel::kOblateCone}) {
    const double full_s = edge_s([&](double t_s) { return lit(model, t_s) < 1.0; });
    const double none_s = edge_s([&](double t_s) { return lit(model, t_s) > 0.0; });
    constexpr int kSteps = 2000;
    double sum = 0;
    double before = 1.0;
    for (int i = 0; i < kSteps; ++i) {
      const double now = lit(model, full_s + (none_s - full_s) * (i + 0.5) / kSteps);
      EXPECT_LE(now, before);
      EXPECT_LT(before - now, 5.0 / kSteps);  // no steps: at most 4/pi of the mean
      sum += now / kSteps;
      before = now;
    }
    EXPECT_NEAR(sum, 0.5, 0.01);
  }
}

TEST_P(ShadowEdges, ShowAsMuchOfTheDiscAsIsCounted) {
  struct Rung {
    ShadowModel model;
    double flattening;
    double allowed;
  };
  // Counting: a row of places, 1 / sqrt(20000) / 2. Oblate: a third of a percent of the disc more.
  for (const Rung& rung : {Rung{ShadowModel::kCone, 0.0, 0.0036},
                           Rung{ShadowModel::kOblateCone, kFlattening, 0.007}}) {
    const double full_s = edge_s([&](double t_s) { return lit(rung.model, t_s) < 1.0; });
    const double none_s = edge_s([&](double t_s) { return lit(rung.model, t_s) > 0.0; });
    for (int i = 0; i <= 10; ++i) {
      const double t_s = full_s + (none_s - full_s) * i / 10.0;
      EXPECT_NEAR(lit(rung.model, t_s), counted_lit_fraction(body(t_s).m, sun_.m, rung.flattening),
                  rung.allowed)
          << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, ShadowEdges, testing::ValuesIn(kGolden));

TEST(Shadow, IsTheDiscsFromLowOrbitToTheMoon) {
  // A limb that were straight would be .03 off at the Moon.
  const Position<J2000> sun{{kAstronomicalUnit_m, 0, 0}};
  for (const double r_m : {6.7e6, 8e6, 42.164e6, 3.8e8}) {
    const double behind_m = std::sqrt(r_m * r_m - kEarthRadius_m * kEarthRadius_m);
    for (int i = -8; i <= 8; ++i) {
      const double off_m = kEarthRadius_m + i / 8.0 * behind_m * kSunRadius_m / kAstronomicalUnit_m;
      const Vector3d body(-std::sqrt(r_m * r_m - off_m * off_m), 0.0, off_m);
      EXPECT_NEAR(lit_fraction(ShadowModel::kCone, {body}, sun),
                  counted_lit_fraction(body, sun.m, 0.0), 0.0045)
          << r_m << ' ' << i;
    }
  }
}

TEST(Shadow, KeepsItsSideForMotionsShorterThanItsMargin) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> axis;
  std::uniform_real_distribution<double> height_m(100e3, 4e7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Position<J2000> sun = sun_at(77.0);
  const auto direction = [&] {
    return Vector3d(axis(random), axis(random), axis(random)).normalized();
  };
  for (const ShadowModel model :
       {ShadowModel::kCylinder, ShadowModel::kCone, ShadowModel::kOblateCone}) {
    int dark = 0;
    for (int i = 0; i < 100000; ++i) {
      const Vector3d body = direction() * (kEarthRadius_m + height_m(random));
      const double margin_m = shadow_margin_m(model, {body}, sun);
      const Vector3d moved = body + direction() * (unit(random) * std::abs(margin_m));
      if (moved.norm() < kEarthRadius_m + 1.0) continue;
      ASSERT_EQ(shadow_margin_m(model, {moved}, sun) > 0.0, margin_m > 0.0) << i;
      dark += margin_m > 0.0 ? 0 : 1;
    }
    EXPECT_GT(dark, 2000);
  }
}

TEST(Shadow, IsFiniteAtTheGroundAndFarAway) {
  const Position<J2000> sun = sun_at(0.0);
  for (const ShadowModel model :
       {ShadowModel::kCylinder, ShadowModel::kCone, ShadowModel::kOblateCone}) {
    for (const double r_m : {kEarthRadius_m, kEarthRadius_m * (1.0 - 1e-9), 1e9, 1e10}) {
      for (const Vector3d& d : {Vector3d(-1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1),
                                Vector3d(-0.999995, 0.003, 0.0).normalized()}) {
        const double lit = lit_fraction(model, {r_m * d}, sun);
        EXPECT_GE(lit, 0.0);
        EXPECT_LE(lit, 1.0);
      }
    }
  }
}

}  // namespace
}  // namespace engine
