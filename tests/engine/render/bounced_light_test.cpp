#include "engine/render/bounced_light.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3f;
using test_support::add_plate;
using test_support::lambert_material;
using test_support::Moments;

struct Furnace {
  double escaped = 0;  ///< what the path brings from a sky of radiance 1
  double cut = 0;      ///< what it carried when it was as long as it may be
  int bounces = 0;
};

/// A path from `from`, in a sky of radiance 1 and without a lamp.
Furnace in_white_sky(const TracedTarget& target, const BouncedLight& bounced,
                     const SurfacePoint& from, const Vector3f& direction,
                     const SampleNumbers& numbers) {
  RayCounts counts;
  BouncedLight::Path path{from, direction, numbers};
  while (bounced.go_on(path)) {
    const MeshHit hit = target.scene.intersect(path.from.start(), path.direction, counts);
    if (hit.triangle == MeshHit::kNone)
      return {static_cast<double>(path.weight), 0.0, path.bounces};
    static_cast<void>(bounced.arrive(LampCones{}, path, target.facets.at(hit, path.direction)));
  }
  const bool cut = bounced.longest(path);
  return {0.0, cut ? static_cast<double>(path.weight) : 0.0, path.bounces};
}

/// Floor and two walls that meet in a corner, open towards (1, 1, 1).
Mesh corner(const std::string& material) {
  Mesh mesh;
  add_plate(mesh, material, {0, 0, 0}, {4, 0, 0}, {0, 4, 0});
  add_plate(mesh, material, {0, 0, 0}, {0, 4, 0}, {0, 0, 4});
  add_plate(mesh, material, {0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  return mesh;
}

const Vector3f kInwards = Vector3f(-1, -1, -1).normalized();

/// A place of the corner that the camera sees.
SurfacePoint place_in(const TracedTarget& target, const std::array<float, 2>& at) {
  RayCounts counts;
  const Vector3f start = Vector3f(0.2F + 3.0F * at[0], 0.2F + 3.0F * at[1], 0.5F) - 2.0F * kInwards;
  const MeshHit hit = target.scene.intersect(start, kInwards, counts);
  EXPECT_NE(hit.triangle, MeshHit::kNone);
  return target.facets.at(hit, kInwards);
}

TEST(WhiteFurnace, WhiteBodyIsAsBrightAsTheSkyAtAnyDepth) {
  // A body of albedo 1 in a sky of radiance 1 cannot be seen: what escapes and what the depth cuts
  // off add up to 1, whatever the sampler. With `uniform` weights differ and roulette is at work.
  const TracedTarget target(corner("white"), {lambert_material("white", 1.0)});
  for (const BrdfSampler sampler :
       {BrdfSampler::kMixture, BrdfSampler::kCosine, BrdfSampler::kUniform}) {
    for (const int bounces : {1, 2, 5, 16}) {
      const BouncedLight bounced(target, BounceRules{bounces, sampler});
      Moments all;
      Moments cut;
      for (std::uint32_t i = 0; i < 40000; ++i) {
        const SampleNumbers numbers(SequenceKind::kIndependent, 3, i);
        const Furnace f =
            in_white_sky(target, bounced, place_in(target, numbers.pair(0)), kInwards, numbers);
        ASSERT_LE(f.bounces, bounces);
        all.add(f.escaped + f.cut);
        cut.add(f.cut);
      }
      EXPECT_NEAR(all.mean(), 1.0, 4.0 * all.sigma_of_mean() + 1e-6) << bounces;
      if (bounces == 1) {
        EXPECT_GT(cut.mean(), 0.2);
      }
      if (bounces == 16) {
        EXPECT_LT(cut.mean(), 0.01);
      }
    }
  }
}

TEST(WhiteFurnace, GlossyBodiesNeverOutshineTheSky) {
  for (const FiveParameters& surface : {test_support::silicon(), test_support::polyimide()}) {
    const TracedTarget target(corner("glossy"), {{"glossy", surface}});
    const BouncedLight bounced(target, BounceRules{16});
    Moments light;
    for (std::uint32_t i = 0; i < 40000; ++i) {
      const SampleNumbers numbers(SequenceKind::kSobol, 5, i);
      light.add(in_white_sky(target, bounced, place_in(target, numbers.pair(0)), kInwards, numbers)
                    .escaped);
    }
    EXPECT_LT(light.mean(), 1.0 + 4.0 * light.sigma_of_mean());
    EXPECT_GT(light.mean(), 0.05);
  }
}

TEST(WhiteFurnace, ConvexBodyGivesItsDirectionalAlbedo) {
  for (const FiveParameters& surface : {test_support::silicon(), test_support::polyimide()}) {
    Mesh mesh;
    add_plate(mesh, "glossy", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    const TracedTarget target(mesh, {{"glossy", surface}});
    for (const BrdfSampler sampler :
         {BrdfSampler::kMixture, BrdfSampler::kCosine, BrdfSampler::kUniform}) {
      const BouncedLight bounced(target, BounceRules{4, sampler});
      const SurfacePoint at = target.facets.on_side(0, 0.2F, 0.2F, 0);
      const double deg = 35.0;
      const Vector3f down(static_cast<float>(std::sin(deg * kDegree)), 0.0F,
                          static_cast<float>(-std::cos(deg * kDegree)));
      Moments light;
      for (std::uint32_t i = 0; i < 200000; ++i)
        light.add(
            in_white_sky(target, bounced, at, down, SampleNumbers(SequenceKind::kIndependent, 9, i))
                .escaped);
      // The albedo's table is good to .5 %.
      const double albedo = target.facets.brdf(0).albedo(std::cos(deg * kDegree));
      EXPECT_NEAR(light.mean(), albedo, 4.0 * light.sigma_of_mean() + 0.005 * albedo);
    }
  }
}

/// A closed box, seen from its inside.
Mesh box() {
  Mesh mesh;
  const Vector3f o(-1, -1, -1);
  const std::array<Vector3f, 3> e{Vector3f(2, 0, 0), Vector3f(0, 2, 0), Vector3f(0, 0, 2)};
  for (std::size_t k = 0; k < 3; ++k) {
    add_plate(mesh, "wall", o, e[k], e[(k + 1) % 3]);
    add_plate(mesh, "wall", o + e[(k + 2) % 3], e[k], e[(k + 1) % 3]);
  }
  return mesh;
}

TEST(BouncedLight, PathsInAClosedMirrorEndAndCarryAllThatWasCut) {
  // No number of bounces, however large, makes a path longer than 16, and nothing leaks out.
  const TracedTarget target(box(), {lambert_material("wall", 1.0)});
  const BouncedLight bounced(target, BounceRules{1000});
  EXPECT_EQ(bounced.bounces(), 16);
  Moments cut;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const SampleNumbers numbers(SequenceKind::kSobol, 1, i);
    const SurfacePoint from = target.facets.on_side(i % 12, 0.3F, 0.3F, 0);
    const bool inside = from.normal.dot(from.place) < 0.0F;
    const SurfacePoint start = inside ? from : target.facets.on_side(i % 12, 0.3F, 0.3F, 1);
    const Furnace f = in_white_sky(target, bounced, start, Vector3f(-start.normal), numbers);
    ASSERT_EQ(f.bounces, 16);
    ASSERT_EQ(f.escaped, 0.0);
    cut.add(f.cut);
  }
  EXPECT_NEAR(cut.mean(), 1.0, 1e-5);
}

TEST(BouncedLight, BlackSurfacesEndAPathAtOnce) {
  const TracedTarget target(box(), {lambert_material("wall", 0.0)});
  const BouncedLight bounced(target, BounceRules{16});
  BouncedLight::Path path{target.facets.on_side(0, 0.3F, 0.3F, 1), {0, 0, -1}, {}};
  EXPECT_FALSE(bounced.go_on(path));
}

/// A roof that the Sun does not reach, above a glossy floor whose glint it sees.
Mesh glint_under_roof() {
  Mesh mesh;
  add_plate(mesh, "floor", {-8, -4, 0}, {8, 0, 0}, {0, 8, 0});
  add_plate(mesh, "roof", {0, -4, 6}, {4, 0, 0}, {0, 8, 0});
  return mesh;
}

TEST(BouncedLight, AskingForTheLampAndRunningIntoItShareTheWork) {
  // With one bounce the floor's glint is found by asking for the lamp alone. With two, the path
  // goes on from the floor and may run into the lamp: the two together must make the same light,
  // for the roof's underside is dark and nothing else is met.
  const Lamp sun{{Eigen::Vector3d(-0.5, 0, 1).normalized()}, 600.0};
  const Material floor{"floor", test_support::polyimide(), Brdf::Variant::kPhysical, 2.0 * kDegree};
  const TracedTarget target(glint_under_roof(), {floor, lambert_material("roof", 0.8)});
  const LampCones lamps{LampCone(sun, 3.0 * kDegree), LampCone()};
  const SurfacePoint from{{1.0F, 0.0F, 6.0F}, {0, 0, -1}, 1, 1e-4F};
  const auto light = [&](int bounces, BrdfSampler sampler) {
    const BouncedLight bounced(target, BounceRules{bounces, sampler, true});
    Moments m;
    RayCounts counts;
    for (std::uint32_t i = 0; i < 150000; ++i)
      m.add(bounced.radiance(lamps, from, {0, 0, 1},
                             SampleNumbers(SequenceKind::kIndependent, 11, i), counts));
    return m;
  };
  const Moments asked = light(1, BrdfSampler::kMixture);
  EXPECT_GT(asked.mean(), 20.0 * asked.sigma_of_mean());
  for (const BrdfSampler sampler :
       {BrdfSampler::kMixture, BrdfSampler::kCosine, BrdfSampler::kUniform}) {
    const Moments both = light(2, sampler);
    EXPECT_NEAR(both.mean(), asked.mean(),
                4.0 * std::hypot(both.sigma_of_mean(), asked.sigma_of_mean()));
  }
}

TEST(BouncedLight, SpreadingCausticsKeepsTheLightOfAMattFloor) {
  const Lamp sun{{Eigen::Vector3d(-0.5, 0, 1).normalized()}, 600.0};
  const TracedTarget target(glint_under_roof(),
                            {lambert_material("floor", 0.4), lambert_material("roof", 0.8)});
  const LampCones lamps{LampCone(sun, 0.0), LampCone()};
  const SurfacePoint from{{1.0F, 0.0F, 6.0F}, {0, 0, -1}, 1, 1e-4F};
  std::array<double, 2> light{};
  for (const bool exact : {false, true}) {
    const BouncedLight bounced(target, BounceRules{1, BrdfSampler::kMixture, exact});
    RayCounts counts;
    for (std::uint32_t i = 0; i < 4096; ++i)
      light[exact ? 1 : 0] += bounced.radiance(lamps, from, {0, 0, 1},
                                               SampleNumbers(SequenceKind::kSobol, 2, i), counts);
  }
  EXPECT_GT(light[0], 0.0);
  EXPECT_NEAR(light[1] / light[0], 1.0, 1e-5);
}

}  // namespace
}  // namespace engine
