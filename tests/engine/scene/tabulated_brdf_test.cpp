#include "engine/scene/tabulated_brdf.h"

#include <array>
#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/scene/brdf.h"
#include "engine/scene/hemisphere_integral.h"
#include "tests/support/goniometer.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::measure;
using test_support::scanned;
using test_support::steps;

/// A table of what `f` does, measured every ten degrees.
template <class F>
TabulatedBrdf table_of(const F& f, bool reciprocal = true) {
  return {std::make_shared<BrdfGrid>(scanned({5, 10, 20, 30, 40, 50, 60, 70, 80}, f)), reciprocal};
}

const FiveParameterBrdf& polyimide() {
  static const FiveParameterBrdf brdf(test_support::polyimide(), Brdf::Variant::kPhysical, 0.0);
  return brdf;
}
/// Polyimide as its table has it.
const TabulatedBrdf& tabulated_polyimide() {
  static const TabulatedBrdf brdf =
      table_of([](const Vector3d& in, const Vector3d& out) { return polyimide().eval(in, out); });
  return brdf;
}

Vector3d random_direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double z = unit(random);
  const double a = 2.0 * kPi * unit(random);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

TEST(TabulatedBrdf, OfALambertSurfaceIsOne) {
  const TabulatedBrdf brdf = table_of([](const auto&, const auto&) { return 0.3 / kPi; });
  EXPECT_EQ(brdf.lobe_half_width_rad(), 0.0);
  EXPECT_NEAR(brdf.diffuse_albedo(), 0.3, 1e-3);
  // Midpoints of 96 rings and 32 turns that end at the horizon.
  for (const double c : {0.01, 0.1, 0.5, 1.0}) EXPECT_NEAR(brdf.albedo(c), 0.3, 1e-3) << c;
  std::mt19937_64 random(1);
  const Brdf whole(brdf);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Vector3d out = random_direction(random);
    ASSERT_NEAR(brdf.eval(random_direction(random), out), 0.3 / kPi, 1e-12);
    Draws draws(5, Stream::kLight, 0, i);
    const float u = draws.uniform();
    const Brdf::Sample s =
        whole.sample(out, BrdfSampler::kMixture, {u, draws.uniform()}, draws.uniform());
    ASSERT_NEAR(s.weight, 0.3, 1e-9);
  }
}

TEST(TabulatedBrdf, HasTheAlbedoAndTheLobeOfWhatWasMeasured) {
  const TabulatedBrdf& brdf = tabulated_polyimide();
  // Chords of logarithms between incidences and between steps of 5 deg; weighing the values
  // themselves is off by 3 % at 60 deg and by 4.6 % at 70.
  for (const double deg : {5.0, 25.0, 45.0, 60.0, 70.0})
    EXPECT_NEAR(brdf.albedo(std::cos(deg * kDegree)) / polyimide().albedo(std::cos(deg * kDegree)),
                1.0, 0.015)
        << deg;
  EXPECT_NEAR(brdf.lobe_half_width_rad(), polyimide().lobe_half_width_rad(), 0.1 * kDegree);
  EXPECT_NEAR(brdf.diffuse_albedo(), polyimide().diffuse_albedo(),
              0.25 * polyimide().diffuse_albedo());
}

TEST(TabulatedBrdf, IsReciprocalWhateverWasMeasured) {
  const auto lopsided = [](const Vector3d& in, const Vector3d& out) {
    return polyimide().as_printed(in, out);
  };
  const auto grid = std::make_shared<BrdfGrid>(scanned({5, 20, 40, 60}, lopsided));
  const TabulatedBrdf made(grid, true);
  const TabulatedBrdf as_it_is(grid, false);
  std::mt19937_64 random(3);
  double furthest = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector3d a = random_direction(random);
    Vector3d b = random_direction(random);
    if (i % 2 == 0) b = (Vector3d(-a.x(), -a.y(), a.z()) + 0.03 * b).normalized();
    const double ab = made.eval(a, b);
    ASSERT_NEAR(ab, made.eval(b, a), 1e-12 * ab);
    furthest = std::max(furthest, std::abs(as_it_is.eval(a, b) / as_it_is.eval(b, a) - 1.0));
  }
  EXPECT_GT(furthest, 0.5);
}

TEST(TabulatedBrdf, NeverSendsBackMoreThanCameIn) {
  // Three times as bright: 1.7 of the light head-on, still 1.2 of it at 80 deg.
  const TabulatedBrdf brdf = table_of(
      [](const Vector3d& in, const Vector3d& out) { return 3.0 * polyimide().eval(in, out); });
  EXPECT_GT(brdf.albedo_as_measured(0.9), 1.5);
  for (const double deg : {0.0, 30.0, 60.0, 75.0, 80.0, 85.0, 89.0, 89.9}) {
    const double cos_in = std::cos(deg * kDegree);
    const double integrated = hemisphere_integral<300, 96>(
        cos_in, [&](const Vector3d& in, const Vector3d& out) { return brdf.eval(in, out); });
    // The .5 % that the albedo's table may be off.
    EXPECT_LE(integrated, 1.005) << deg;
    EXPECT_NEAR(brdf.albedo(cos_in), integrated, 0.01 + 0.01 * integrated) << deg;
  }
}

TEST(TabulatedBrdf, OfATableNextToThePlaneOfIncidenceIsNotDarkenedAtTheNormal) {
  for (const double furthest_deg : {10.0, 14.0}) {
    BrdfPoints points;
    for (const double theta : {0.0, 20.0, 40.0, 60.0, 75.0})
      for (const double p : steps(-86, 86, 2))
        for (const double o : steps(0, furthest_deg, 2))
          measure(points, theta, p, o, [](const Vector3d& in, const Vector3d& out) {
            const Vector3d mirror(-in.x(), -in.y(), in.z());
            const double a = std::atan2(mirror.cross(out).norm(), mirror.dot(out));
            return 0.05 + 10.0 * std::exp(-std::pow(a / (8.0 * kDegree), 2));
          });
    const TabulatedBrdf brdf(std::make_shared<BrdfGrid>(points), true);
    // The held edge all round normal light made 3.9 and 1.4 of its albedo, and 2.6 and 7.0 of this.
    for (const double deg : {0.0, 1.0, 3.0}) {
      const Vector3d in = incident_direction(deg * kDegree);
      EXPECT_NEAR(brdf.eval(in, {-in.x(), 0.0, in.z()}), 10.05, 0.01) << furthest_deg << " " << deg;
    }
    // .05 pi and the lobe's own, 10 pi (8 deg)^2, less 2 % for its cosine.
    EXPECT_NEAR(brdf.albedo_as_measured(1.0), 0.76, 0.1) << furthest_deg;
  }
}

TEST(TabulatedBrdf, ANarrowLobeBackToTheSourceMakesNoLight) {
  // Retroreflecting tape, a degree wide: 2 pi (1 deg)^2 1050 = 2 of the light. A goniometer makes
  // its steps fine there.
  BrdfPoints points;
  for (const double theta : {20.0, 45.0, 70.0}) {
    std::vector<double> first = steps(-85, 85, 5);
    for (const double off : {-3.0, -2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 1.5, 2.0, 3.0})
      first.push_back(-theta + off);
    for (const double p : first)
      for (const double o : {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 20.0, 50.0, 85.0})
        measure(points, theta, p, o, [](const Vector3d& in, const Vector3d& out) {
          return 0.02 + 1050.0 * std::exp(-(in - out).squaredNorm() / (2.0 * std::pow(kDegree, 2)));
        });
  }
  for (const bool reciprocal : {true, false}) {
    const TabulatedBrdf brdf(std::make_shared<BrdfGrid>(points), reciprocal);
    EXPECT_GT(brdf.lobe_half_width_rad(), 0.0);
    for (const double deg : {20.0, 21.0, 45.0, 46.0, 70.0}) {
      const double theta = deg * kDegree;
      const Vector3d in = incident_direction(theta);
      // In steps of a tenth of a degree about the source, and without what is further off.
      double sum = 0;
      const double step = 0.1 * kDegree;
      for (int i = -80; i <= 80; ++i)
        for (int k = -80; k <= 80; ++k) {
          const Vector3d out =
              scatter_direction(ScatterAngles::kPlanes, -theta + i * step, k * step);
          sum += brdf.eval(in, out) * out.z() * std::cos(k * step) * step * step;
        }
      EXPECT_LE(sum, 1.01) << deg << reciprocal;
      if (deg == 45.0) {
        EXPECT_GT(sum, 0.85);
        EXPECT_NEAR(brdf.albedo(std::cos(theta)), 1.0, 0.1);
      }
    }
  }
}

TEST(TabulatedBrdf, SheenAtGrazingIsALobeThoughNormalLightIsEven) {
  const TabulatedBrdf brdf = table_of([](const Vector3d& in, const Vector3d& out) {
    const Vector3d mirror(-in.x(), -in.y(), in.z());
    const double sheen = std::max(0.0, 0.5 - in.z()) * std::max(0.0, 0.5 - out.z());
    return 0.1 + 50.0 * sheen * std::exp(-(mirror - out).squaredNorm() / 0.02);
  });
  EXPECT_GT(brdf.lobe_half_width_rad(), 1.0 * kDegree);
  EXPECT_GT(brdf.lobe_share(incident_direction(75.0 * kDegree)), 0.0);
  EXPECT_NEAR(brdf.diffuse_albedo(), 0.1 * kPi, 1e-3);
}

TEST(TabulatedBrdf, IsFiniteAndNotNegativeAtGrazing) {
  const TabulatedBrdf& brdf = tabulated_polyimide();
  const Brdf whole(brdf);
  const auto tilted = [](double deg, double azimuth_deg) {
    return scatter_direction(ScatterAngles::kPolar, deg * kDegree, azimuth_deg * kDegree);
  };
  for (const double a : {0.0, 1e-9, 45.0, 89.9, 89.9999, 90.0, 91.0}) {
    for (const double b : {0.0, 1e-9, 45.0, 89.9, 89.9999, 90.0, 91.0}) {
      for (const double azimuth : {0.0, 90.0, 180.0}) {
        const double f = brdf.eval(tilted(a, 0), tilted(b, azimuth));
        ASSERT_TRUE(std::isfinite(f) && f >= 0.0) << a << " " << b;
        ASSERT_TRUE(f == 0.0 || (a < 90.0 && b < 90.0));
        const double density = whole.pdf(tilted(a, 0), tilted(b, azimuth));
        ASSERT_TRUE(std::isfinite(density) && density >= 0.0) << a << " " << b;
        ASSERT_TRUE(f == 0.0 || density > 0.0);
      }
    }
    for (std::uint32_t i = 0; i < 500; ++i) {
      Draws draws(13, Stream::kLight, 0, i);
      const float u = draws.uniform();
      const Brdf::Sample s =
          whole.sample(tilted(a, 0), BrdfSampler::kMixture, {u, draws.uniform()}, draws.uniform());
      ASSERT_TRUE(s.in.allFinite() && std::isfinite(s.weight) && s.weight >= 0.0) << a;
    }
  }
}

}  // namespace
}  // namespace engine
