#include "engine/render/facets.h"

#include <atomic>
#include <random>

#include <gtest/gtest.h>

#include "engine/core/worker_pool.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(BasisRound, IsARightHandedBasisAboutAnyNormal) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> axis;
  for (int i = 0; i < 10000; ++i) {
    Vector3d n(axis(random), axis(random), axis(random));
    if (i == 0) n = {0, 0, 1};
    if (i == 1) n = {0, 0, -1};
    if (i == 2) n = {1, 0, -0.0};
    n.normalize();
    const Matrix3d basis = basis_round(n);
    // Duff et al. 2017 state 1e-15 and a bit for double precision.
    ASSERT_LT((basis * basis.transpose() - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 3e-15);
    ASSERT_NEAR(basis.determinant(), 1.0, 3e-15);
    ASSERT_EQ(Vector3d(basis.row(2)), n);
  }
}

TEST(Facets, LightIsIrradianceTimesBrdfTimesCosine) {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  Facets facets(mesh, {Brdf(test_support::lambert(0.3), Brdf::Variant::kPhysical)});
  Snapshot snapshot = test_support::look_at_origin({0, 0, 1e5}, {0, 1, 0});
  for (const double deg : {0.0, 30.0, 60.0, 89.0, 91.0, 180.0}) {
    snapshot.sun = {{{std::sin(deg * kDegree), 0.0, std::cos(deg * kDegree)}}, 600.0};
    snapshot.earthshine = {{{0.0, 0.0, 1.0}}, 50.0};
    facets.light_up(snapshot);
    const double want = deg < 90.0 ? 600.0 * 0.3 / kPi * std::cos(deg * kDegree) : 0.0;
    for (const std::uint32_t t : {0U, 1U}) {
      EXPECT_NEAR(static_cast<double>(facets.radiance(t)[0]), want, 6e-8 * 60.0) << deg;
      EXPECT_NEAR(static_cast<double>(facets.radiance(t)[1]), 50.0 * 0.3 / kPi, 6e-8 * 60.0);
    }
  }
}

TEST(Facets, OffsetClearsTheSurfaceOnTheSideThatIsLookedAt) {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  const Facets facets(mesh, {Brdf(test_support::lambert(0.3), Brdf::Variant::kPhysical)});
  const MeshHit hit{0, 0.25F, 0.25F};
  const SurfacePoint above = facets.at(hit, {0.0F, 0.0F, -1.0F});
  EXPECT_GT(above.start().z(), 0.0F);
  const SurfacePoint below = facets.at(hit, {0.0F, 0.0F, 1.0F});
  EXPECT_LT(below.start().z(), 0.0F);
  EXPECT_EQ(above.place, below.place);
}

/// What a plate sends up when the Sun stands `off_deg` beside the mirror direction of a camera at
/// 30 deg: as a disc, over as a point.
double disc_over_point(const FiveParameters& surface, double off_deg, double wrinkle_rad = 0) {
  Mesh mesh;
  test_support::add_plate(mesh, "glossy", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  Facets facets(mesh, {Brdf(surface, Brdf::Variant::kPhysical, wrinkle_rad)});
  const double from = 30.0 * kDegree;
  Snapshot snapshot =
      test_support::look_at_origin(1e5 * Vector3d(std::sin(from), 0, std::cos(from)), {0, 1, 0});
  const double sun = -(30.0 + off_deg) * kDegree;
  snapshot.sun = {{{std::sin(sun), 0.0, std::cos(sun)}}, 600.0};
  facets.light_up(snapshot);
  const auto disc = static_cast<double>(facets.radiance(0)[0]);
  facets.light_up(snapshot, 0.0);
  return disc / static_cast<double>(facets.radiance(0)[0]);
}

TEST(SunDisc, TakesThePeakOfAGlint) {
  // The golden ratios of disc to point at the top of both lobes.
  EXPECT_NEAR(disc_over_point(test_support::silicon(), 0.0), 0.877, 0.01);
  EXPECT_NEAR(disc_over_point(test_support::polyimide(), 0.0), 0.905, 0.01);
}

TEST(SunDisc, HardlyShowsHalfADegreeOffThePeakAndIsLeftOutFarFromIt) {
  for (const double off_deg : {0.5, 1.0, 1.5, 2.5, 4.0}) {
    EXPECT_NEAR(disc_over_point(test_support::silicon(), off_deg), 1.0, 0.013) << off_deg;
    EXPECT_NEAR(disc_over_point(test_support::polyimide(), off_deg), 1.0, 0.013) << off_deg;
  }
  EXPECT_EQ(disc_over_point(test_support::silicon(), 8.0), 1.0);
  EXPECT_EQ(disc_over_point(test_support::lambert(0.3), 0.0), 1.0);
  // A lobe much wider than the disc is even over it.
  EXPECT_EQ(disc_over_point(test_support::polyimide(), 0.0, 15.0 * kDegree), 1.0);
}

TEST(SunDisc, KeepsTheLightOfAGlint) {
  // Over all places of the Sun the disc takes nothing and adds nothing: the sums over a grid round
  // the peak are the same, to what the lobe bends between its points.
  double disc = 0;
  double point = 0;
  Mesh mesh;
  test_support::add_plate(mesh, "glossy", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  Facets facets(mesh, {Brdf(test_support::polyimide(), Brdf::Variant::kPhysical)});
  Snapshot snapshot = test_support::look_at_origin({0, 0, 1e5}, {0, 1, 0});
  constexpr double kStep_rad = 0.1 * kDegree;
  for (int i = -30; i <= 30; ++i) {
    for (int j = -30; j <= 30; ++j) {
      // Between the facet's middle and the origin lies a third of a metre, at 100 km.
      const Vector3d to_sun((i + 0.37) * kStep_rad, (j + 0.21) * kStep_rad, 1.0);
      snapshot.sun = {direction_of<BodyFrame>(to_sun), 600.0};
      facets.light_up(snapshot);
      disc += static_cast<double>(facets.radiance(0)[0]);
      facets.light_up(snapshot, 0.0);
      point += static_cast<double>(facets.radiance(0)[0]);
    }
  }
  EXPECT_NEAR(disc / point, 1.0, 0.01);
}

TEST(Facets, NoLightBeyondTheTerminatorByMoreThanAFacetsOwnAngle) {
  // Facets that stand for a smooth ball are lit by its normals; one that turns away from the Sun by
  // more than its normals differ must stay dark.
  const Mesh ball = test_support::sphere(5.0F, 24, 48, "glossy");
  Facets facets(ball, {Brdf(test_support::polyimide(), Brdf::Variant::kPhysical)});
  for (const double phase_deg : {30.0, 90.0, 150.0, 178.0}) {
    Snapshot snapshot = test_support::look_at_origin({1e5, 0, 0}, {0, 0, 1});
    snapshot.sun = {{{std::cos(phase_deg * kDegree), std::sin(phase_deg * kDegree), 0.0}}, 600.0};
    facets.light_up(snapshot);
    int lit = 0;
    for (std::uint32_t t = 0; t < ball.triangles.size(); ++t) {
      const SurfacePoint place = facets.on_side(t, 0.3F, 0.3F, 0);
      const double toward = place.normal.cast<double>().dot(snapshot.sun.toward.unit);
      if (place.normal.x() <= 0.0F) continue;  // its inside would be seen
      lit += facets.radiance(t)[0] > 0.0F ? 1 : 0;
      // Facets span 7.5 deg; their corners' normals are half of a diagonal off, then the Sun's
      // radius.
      if (toward < -std::sin((3.75 * 1.5 + 0.3) * kDegree)) {
        EXPECT_EQ(facets.radiance(t)[0], 0.0F) << phase_deg << " " << t;
      }
    }
    EXPECT_GT(lit, 0) << phase_deg;
  }
}

TEST(Facets, LightIsTheSameWhoeverAsksFirst) {
  const Mesh ball = test_support::sphere(5.0F, 24, 48, "glossy");
  Facets alone(ball, {Brdf(test_support::polyimide(), Brdf::Variant::kPhysical)});
  Facets shared = alone;
  WorkerPool pool(4);
  for (const double phase_deg : {30.0, 60.0}) {
    Snapshot snapshot = test_support::look_at_origin({1e5, 0, 0}, {0, 0, 1});
    snapshot.sun = {{{std::cos(phase_deg * kDegree), std::sin(phase_deg * kDegree), 0.0}}, 600.0};
    alone.light_up(snapshot);
    shared.light_up(snapshot);
    const auto count = static_cast<std::uint32_t>(ball.triangles.size());
    std::atomic<int> differs{0};
    pool.rows(0, 8, [&](int row) {
      for (std::uint32_t t = 0; t < count; ++t)
        differs += shared.radiance((t + 7U * static_cast<std::uint32_t>(row)) % count)[0] < 0.0F;
    });
    for (std::uint32_t t = 0; t < count; ++t)
      differs += shared.radiance(t) != alone.radiance(t) ? 1 : 0;
    EXPECT_EQ(differs.load(), 0) << phase_deg;
  }
}

}  // namespace
}  // namespace engine
