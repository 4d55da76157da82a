#include "engine/render/bounce_depth.h"

#include <gtest/gtest.h>

#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::add_plate;
using test_support::lambert_material;

const SensorNoise kSensor{100.0, 25.0, 15000.0, 0.68};

TEST(SelfVisibility, ConvexBodySeesNothingOfItself) {
  const TracedTarget ball(test_support::sphere(5.0F, 24, 48, "white"),
                          {lambert_material("white", 0.3)});
  const SelfVisibility seen = self_visibility(ball);
  EXPECT_EQ(seen.share, 0.0);
  EXPECT_NEAR(seen.largest_albedo, 0.3, 1e-6);
}

TEST(SelfVisibility, CornerSeesItselfAsItsFormFactorSays) {
  // Squares that share an edge: .20004 of each other (Howell, A Catalog of Radiation Heat Transfer
  // Configuration Factors, C-14). Half of what is seen from everywhere are their outsides, and what
  // is seen of the insides is seen less where the other plate is in the way.
  Mesh mesh;
  add_plate(mesh, "white", {0, 0, 0}, {4, 0, 0}, {0, 4, 0});
  add_plate(mesh, "white", {0, 0, 0}, {0, 4, 0}, {0, 0, 4});
  const SelfVisibility seen = self_visibility(TracedTarget(mesh, {lambert_material("white", 0.5)}));
  EXPECT_LT(seen.share, 0.5 * 0.20004 + 0.01);
  EXPECT_GT(seen.share, 0.25 * 0.20004);
}

TEST(BounceDepth, FollowsTheSeriesUntilTheRestIsInTheNoise) {
  // Albedo .18, a fifth seen, 15 000 e-: a second reflection brings 540 e-, a third 19, and .3 of
  // the noise is 37.
  const SelfVisibility seen{0.2, 0.18};
  EXPECT_NEAR(left_out_e(seen, 0, 15000.0), 560.0, 1.0);
  EXPECT_NEAR(left_out_e(seen, 1, 15000.0), 20.2, 0.1);
}

TEST(BounceDepth, IsNoneForAConvexBodyAndDeeperForAStricterProfile) {
  RenderSpec spec;
  spec.noise = kSensor;
  spec.bounces_by_need = true;
  const TracedTarget ball(test_support::sphere(5.0F, 24, 48, "white"),
                          {lambert_material("white", 0.3)});
  const RenderSpec convex = with_bounces_settled(spec, ball);
  EXPECT_EQ(convex.bounces, 0);
  EXPECT_EQ(convex.bounces_left_out_e, 0.0);

  const TracedTarget telescope(telescope_mesh(), test_support::telescope_materials());
  const RenderSpec usual = with_bounces_settled(spec, telescope);
  EXPECT_GE(usual.bounces, 1);
  EXPECT_LT(usual.bounces_left_out_e, 1.5 * 0.3 * kSensor.sigma_e(15000.0));
  RenderSpec strict = spec;
  strict.profile = {0.1, 0.063};
  RenderSpec loose = spec;
  loose.profile = {1.0, 0.63};
  EXPECT_GE(with_bounces_settled(strict, telescope).bounces, usual.bounces);
  EXPECT_LE(with_bounces_settled(loose, telescope).bounces, usual.bounces);
  EXPECT_GT(with_bounces_settled(strict, telescope).bounces,
            with_bounces_settled(loose, telescope).bounces);
}

TEST(BounceDepth, LeavesANumberAlone) {
  RenderSpec spec;
  spec.noise = kSensor;
  spec.bounces = 3;
  const TracedTarget telescope(telescope_mesh(), test_support::telescope_materials());
  const RenderSpec settled = with_bounces_settled(spec, telescope);
  EXPECT_EQ(settled.bounces, 3);
  EXPECT_GT(settled.bounces_left_out_e, 0.0);
}

}  // namespace
}  // namespace engine
