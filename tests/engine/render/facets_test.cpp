#include "engine/render/facets.h"

#include <random>

#include <gtest/gtest.h>

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
  WorkerPool pool(1);
  for (const double deg : {0.0, 30.0, 60.0, 89.0, 91.0, 180.0}) {
    snapshot.sun = {{{std::sin(deg * kDegree), 0.0, std::cos(deg * kDegree)}}, 600.0};
    snapshot.earthshine = {{{0.0, 0.0, 1.0}}, 50.0};
    facets.light_up(snapshot, pool);
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

}  // namespace
}  // namespace engine
