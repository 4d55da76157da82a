#include "engine/render/body_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/texel_light.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;
using test_support::add_plate;
using test_support::lambert_material;

/// A cube of 2 m, its faces outward.
Mesh closed_box() {
  Mesh mesh;
  const auto face = [&](const Vector3f& a, const Vector3f& b) {
    const Vector3f n = a.cross(b).normalized();
    add_plate(mesh, "grey", n - 0.5F * (a + b), a, b);
  };
  const Vector3f x(2, 0, 0);
  const Vector3f y(0, 2, 0);
  const Vector3f z(0, 0, 2);
  face(x, y);
  face(y, x);
  face(y, z);
  face(z, y);
  face(z, x);
  face(x, z);
  return mesh;
}

/// A wall on a floor, 12 m wide, 6 m high and 8 m deep.
Mesh corner() {
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  return mesh;
}

TEST(HemisphereBins, EachHoldsTheSameShareByTheCosine) {
  // The disc's area is the cosine's measure: a bin's mean height is that of its square.
  double mean_z = 0;
  Vector3d mean = Vector3d::Zero();
  constexpr int kSteps = 16;
  for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
    for (int i = 0; i < kSteps * kSteps; ++i) {
      const int row = i / kSteps;
      const Vector3f d =
          HemisphereBins::direction(bin, (static_cast<float>(i % kSteps) + 0.5F) / kSteps,
                                    (static_cast<float>(row) + 0.5F) / kSteps);
      ASSERT_NEAR(static_cast<double>(d.norm()), 1.0, 1e-6);
      mean += d.cast<double>() / (HemisphereBins::kBins * kSteps * kSteps);
    }
  }
  mean_z = mean.z();
  EXPECT_NEAR(mean_z, 2.0 / 3.0, 1e-3);  // the mean cosine, drawn by the cosine
  EXPECT_NEAR(mean.x(), 0.0, 1e-6);
  EXPECT_NEAR(mean.y(), 0.0, 1e-6);
}

TEST(BinnedBrdf, SendsOnOfEvenLightTheAlbedo) {
  HemisphereBins::Values even{};
  even.fill(1.0F);
  const BinnedBrdf grey(lambert_material("grey", 0.5).brdf());
  EXPECT_NEAR(static_cast<double>(grey.reflected(even, Vector3f::UnitZ())), 0.5, 1e-6);
  EXPECT_EQ(grey.mirror_share(0.5F), 0.0F);
  const Material foil{"foil", test_support::polyimide(), Brdf::Variant::kPhysical, 15.0 * kDegree};
  const Brdf exact = foil.brdf();
  const BinnedBrdf binned(exact);
  for (const double c : {0.95, 0.7, 0.4}) {
    const Vector3f out(static_cast<float>(std::sqrt(1.0 - c * c)), 0.0F, static_cast<float>(c));
    // 36 places in a bin for a lobe as wide as two, and 12 cosines: 2 %.
    EXPECT_NEAR(static_cast<double>(binned.reflected(even, out)) / exact.albedo(c), 1.0, 0.02) << c;
  }
  // A narrow lobe is the mirror's; both together are the albedo.
  const Brdf panel = Material{"panel", test_support::silicon()}.brdf();
  const BinnedBrdf split(panel);
  const double both = static_cast<double>(split.reflected(even, Vector3f(0.6F, 0.0F, 0.8F))) +
                      static_cast<double>(split.mirror_share(0.8F));
  EXPECT_NEAR(both / panel.albedo(0.8), 1.0, 0.02);
}

TEST(SurfacePatches, HaveNoneInsideAClosedBox) {
  const TracedTarget target(closed_box(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  const SurfacePatches patches(target, 8.0, pool);
  ASSERT_GT(patches.size(), 100U);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const auto& patch = patches.patch(p);
    EXPECT_GT(patch.place.dot(patch.normal), 0.9F);
    // A convex body sees none of itself.
    for (const std::uint32_t seen : patches.seen_from(p)) ASSERT_EQ(seen, SurfacePatches::kSky);
  }
}

TEST(SurfacePatches, EveryPlaceThatACameraSeesHasOne) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  const SurfacePatches patches(target, 20.0, pool);
  for (std::uint32_t f = 0; f < 4; ++f) {
    for (const float a : {0.01F, 0.3F, 0.6F}) {
      const SurfacePoint place = target.facets.on_side(f, a, 0.35F, 0);
      const std::uint32_t p = patches.at(place);
      ASSERT_NE(p, SurfacePatches::kNone);
      EXPECT_GT(patches.patch(p).normal.dot(place.normal), 0.99F);
      EXPECT_LT((patches.patch(p).place - place.place).norm(), 2.0F * patches.cube_m());
    }
  }
}

/// From a place at height h on the wall's middle line to the floor, 12 m wide and 8 m deep:
/// Howell's C-3 for a plane element beside a corner of a rectangle at a right angle, twice.
double wall_to_floor(double h) {
  const double x = 6.0 / h;
  const double y = 8.0 / h;
  const double beside =
      (std::atan(x) - std::atan(x / std::sqrt(1.0 + y * y)) / std::sqrt(1.0 + y * y));
  return 2.0 * beside / (2.0 * kPi);
}

Snapshot before_the_wall(const Vector3d& camera_m = {100e3, 0, 3}) {
  Snapshot snapshot = test_support::view_from(camera_m, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {direction_of<BodyFrame>({0, 0, 1}), 634.64};
  return snapshot;
}

TEST(BodyLight, WallIsLitByTheFloorAsItsFormFactorSays) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  BodyLight light(target, 1, pool);
  light.light_up(before_the_wall(), BodyLight::Renewal::kAtOnce, pool);
  const double leaving = 0.5 * 634.64 / kPi;
  for (const double h : {1.5, 3.0, 4.5}) {
    const SurfacePoint place{{0, 0, static_cast<float>(h)}, {1, 0, 0}, 0, 1e-5F};
    const std::uint32_t patch = light.patches().at(place);
    ASSERT_NE(patch, SurfacePatches::kNone);
    const double want =
        0.5 * leaving * wall_to_floor(static_cast<double>(light.patches().patch(patch).place.z()));
    // 512 fixed rays of which a fifth meet the floor: 9 %.
    EXPECT_NEAR(static_cast<double>(light.to_camera(0, patch)) / want, 1.0, 0.25) << h;
    EXPECT_EQ(light.to_camera(1, patch), 0.0F);
  }
}

/// All that goes to the camera of the Sun's light.
std::vector<float> sunlight_of(const BodyLight& light) {
  std::vector<float> all;
  for (std::uint32_t p = 0; p < light.patches().size(); ++p) all.push_back(light.to_camera(0, p));
  return all;
}

Snapshot with_sun_turned(double rad, const Vector3d& camera_m = {100e3, 0, 3}) {
  Snapshot snapshot = before_the_wall(camera_m);
  snapshot.sun.toward = direction_of<BodyFrame>({std::sin(rad), 0, std::cos(rad)});
  return snapshot;
}

/// What a first frame makes of it.
std::vector<float> sunlight_at_once(const TracedTarget& target, const Snapshot& snapshot,
                                    WorkerPool& pool) {
  BodyLight light(target, 2, pool);
  light.light_up(snapshot, BodyLight::Renewal::kAsNeeded, pool);
  return sunlight_of(light);
}

TEST(BodyLight, ATurnedLampIsWorkedOutInSharesAndComesToTheSame) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(2);
  const std::vector<float> first = sunlight_at_once(target, with_sun_turned(0.0), pool);
  const std::vector<float> last = sunlight_at_once(target, with_sun_turned(0.02), pool);
  ASSERT_NE(first, last);
  BodyLight light(target, 2, pool);
  light.light_up(with_sun_turned(0.0), BodyLight::Renewal::kAsNeeded, pool);
  for (int frame = 1; frame < 32; ++frame) {
    light.light_up(with_sun_turned(0.02), BodyLight::Renewal::kAsNeeded, pool);
    ASSERT_EQ(sunlight_of(light), first) << frame;
  }
  light.light_up(with_sun_turned(0.02), BodyLight::Renewal::kAsNeeded, pool);
  EXPECT_EQ(sunlight_of(light), last);
}

TEST(BodyLight, ALampThatTurnsFasterThanTheSharesIsWorkedOutAtOnce) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  BodyLight light(target, 2, pool);
  light.light_up(with_sun_turned(0.0), BodyLight::Renewal::kAsNeeded, pool);
  // 8 mrad a frame: of what was begun nothing is ready when it is 50 mrad off.
  for (int frame = 1; frame <= 7; ++frame)
    light.light_up(with_sun_turned(0.008 * frame), BodyLight::Renewal::kAsNeeded, pool);
  EXPECT_EQ(sunlight_of(light), sunlight_at_once(target, with_sun_turned(0.056), pool));
  // And whoever asks for all has all.
  light.light_up(with_sun_turned(0.02), BodyLight::Renewal::kAtOnce, pool);
  EXPECT_EQ(sunlight_of(light), sunlight_at_once(target, with_sun_turned(0.02), pool));
}

TEST(BodyLight, WhoHasNoTimeGetsSharesHoweverFarTheLampHasTurned) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  const std::vector<float> last = sunlight_at_once(target, with_sun_turned(0.5), pool);
  BodyLight light(target, 2, pool);
  light.light_up(with_sun_turned(0.0), BodyLight::Renewal::kInShares, pool);
  const std::vector<float> first = sunlight_of(light);
  EXPECT_EQ(first, sunlight_at_once(target, with_sun_turned(0.0), pool));
  for (int frame = 1; frame < 32; ++frame) {
    light.light_up(with_sun_turned(0.5), BodyLight::Renewal::kInShares, pool);
    ASSERT_EQ(sunlight_of(light), first) << frame;
  }
  light.light_up(with_sun_turned(0.5), BodyLight::Renewal::kInShares, pool);
  EXPECT_EQ(sunlight_of(light), last);
}

TEST(BodyLight, WhatGoesToTheCameraIsOfWhereItStandsWithinADegree) {
  // Its lobe is wide enough for the bins to keep.
  const TracedTarget target(corner(), {{"grey", FiveParameters{0.5, -8.0, 3.0, 0.05, 1.0}}});
  WorkerPool pool(1);
  const auto from = [](double deg) {
    const double rad = deg * kDegree;
    return before_the_wall({100e3 * std::cos(rad), 100e3 * std::sin(rad), 3});
  };
  BodyLight light(target, 2, pool);
  light.light_up(from(0.0), BodyLight::Renewal::kAsNeeded, pool);
  const std::vector<float> first = sunlight_of(light);
  light.light_up(from(0.9), BodyLight::Renewal::kAsNeeded, pool);
  EXPECT_EQ(sunlight_of(light), first);
  light.light_up(from(1.1), BodyLight::Renewal::kAsNeeded, pool);
  EXPECT_NE(sunlight_of(light), first);
  EXPECT_EQ(sunlight_of(light), sunlight_at_once(target, from(1.1), pool));
  // A lamp that was off while the camera turned, too; and twice the light is twice as bright.
  Snapshot dark = from(40.0);
  dark.sun.irradiance_w_m2 = 0.0;
  light.light_up(dark, BodyLight::Renewal::kAsNeeded, pool);
  EXPECT_EQ(sunlight_of(light), std::vector<float>(first.size(), 0.0F));
  light.light_up(from(40.0), BodyLight::Renewal::kAsNeeded, pool);
  const std::vector<float> again = sunlight_of(light);
  EXPECT_EQ(again, sunlight_at_once(target, from(40.0), pool));
  Snapshot bright = from(40.0);
  bright.sun.irradiance_w_m2 *= 2.0;
  light.light_up(bright, BodyLight::Renewal::kAsNeeded, pool);
  for (std::size_t p = 0; p < again.size(); ++p)
    ASSERT_EQ(sunlight_of(light)[p], 2.0F * again[p]) << p;
}

TEST(TexelGrid, EveryPlaceOfAFacetHasATexelRoundIt) {
  // Right, blunt and a sliver; with each corner first.
  const std::array<std::array<Vector3f, 3>, 3> shapes = {{{{{0, 0, 0}, {3, 0, 0}, {0, 2, 0}}},
                                                          {{{0, 0, 0}, {5, 0, 0}, {-1, 1, 0}}},
                                                          {{{0, 0, 0}, {8, 0, 0}, {4, 0.01F, 0}}}}};
  Mesh mesh;
  mesh.material_names = {"grey"};
  for (const auto& shape : shapes) {
    for (std::uint32_t first = 0; first < 3; ++first) {
      const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
      for (std::uint32_t i = 0; i < 3; ++i) mesh.vertices.push_back(shape[(first + i) % 3]);
      mesh.triangles.push_back({{base, base + 1, base + 2}, 0});
    }
  }
  const TracedTarget target(mesh, {lambert_material("grey", 0.5)});
  TexelGrid grid(target);
  constexpr float kTexel_m = 0.1F;
  grid.cut(kTexel_m);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    for (const unsigned side : {0U, 1U}) {
      for (const auto& [second, third] :
           {std::array{0.0F, 0.0F}, std::array{1.0F, 0.0F}, std::array{0.0F, 1.0F},
            std::array{0.21F, 0.43F}, std::array{0.5F, 0.5F}, std::array{0.05F, 0.9F}}) {
        const SurfacePoint place = target.facets.on_side(f, second, third, side);
        const std::uint32_t number = grid.at(f, side, second, third);
        ASSERT_LT(number, grid.texels());
        const TexelGrid::Texel texel = grid.texel(number);
        EXPECT_EQ(texel.facet, f);
        EXPECT_EQ(texel.side, side);
        for (const float a : {0.0F, 0.5F, 1.0F}) {
          const SurfacePoint in_it = grid.place(texel, a, 1.0F - a);
          EXPECT_LT((in_it.place - place.place).norm(), 1.5F * kTexel_m) << f;
          EXPECT_EQ(in_it.normal, place.normal);
        }
      }
    }
    // Beyond the edges, and no numbers: some texel of the facet's.
    for (const float wild : {-3.0F, 7.0F, std::nanf(""), 1e30F})
      EXPECT_EQ(grid.texel(grid.at(f, 0, wild, wild)).facet, f);
  }
}

TEST(TexelGrid, FindsWhatIsNear) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  TexelGrid grid(target);
  grid.cut(0.5F);
  const auto middle = [&](std::uint32_t number) {
    // Of the texel's own square, which may reach beyond the facet.
    const TexelGrid::Texel t = grid.texel(number);
    return Vector2f(t.low[0] + 0.5F * t.span[0], t.low[1] + 0.5F * t.span[1]);
  };
  // The floor: 14.42 m along its diagonal, 6.66 m up.
  const Vector2f size(std::hypot(8.0F, 12.0F), 96.0F / std::hypot(8.0F, 12.0F));
  for (const float reach_m : {0.0F, 0.3F, 0.75F, 1.6F}) {
    for (std::uint32_t number = 0; number < grid.texels(); number += 7) {
      const TexelGrid::Texel texel = grid.texel(number);
      if (texel.facet > 1) continue;
      std::vector<std::uint32_t> found;
      grid.each_near(number, texel, reach_m, [&](std::uint32_t near, float distance2_m2) {
        found.push_back(near);
        const float apart_m = (middle(near) - middle(number)).cwiseProduct(size).norm();
        EXPECT_NEAR(std::sqrt(distance2_m2), apart_m, 1e-3F);
      });
      std::vector<std::uint32_t> wanted;
      for (std::uint32_t other = 0; other < grid.texels(); ++other) {
        const TexelGrid::Texel t = grid.texel(other);
        if (t.facet == texel.facet && t.side == texel.side &&
            (middle(other) - middle(number)).cwiseProduct(size).norm() <= reach_m)
          wanted.push_back(other);
      }
      EXPECT_EQ(found, wanted);
    }
  }
  // No more than four away, whatever is asked; of what is no number itself alone.
  int many = 0;
  const TexelGrid::Texel texel = grid.texel(100);
  const auto count = [&](std::uint32_t /*number*/, float /*distance2_m2*/) { ++many; };
  grid.each_near(100, texel, std::numeric_limits<float>::infinity(), count);
  EXPECT_LE(many, 81);
  many = 0;
  grid.each_near(100, texel, std::nanf(""), count);
  EXPECT_EQ(many, 1);
}

TEST(TexelGrid, CutsNoFinerThanThereIsRoomFor) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  TexelGrid grid(target);
  EXPECT_GT(grid.cut(1e-4F), 1e-4F);
  EXPECT_LE(grid.texels(), grid.most_texels());
  EXPECT_GT(grid.texels(), grid.most_texels() / 4);
  EXPECT_EQ(grid.cut(1e6F), 1e6F);
  EXPECT_EQ(grid.texels(), 8U);  // two sides of four facets
}

/// Warm: what is asked for is there, with all its rays.
struct Texels {
  Texels(const Mesh& mesh, const Snapshot& snapshot,
         const Material& grey = lambert_material("grey", 0.5))
      : target(mesh, {grey}),
        pool(2),
        body(target, 1, pool),
        view(target.mesh),
        light(target, body, 1),
        seen(snapshot) {
    view.update(snapshot.sun.toward.unit, pool);
    body.light_up(snapshot, BodyLight::Renewal::kAtOnce, pool);
    light.update(seen, {0, view}, kPx_m, true, pool);
  }
  double at(std::uint32_t facet, float second, float third) {
    (void)light.at(facet, 0, second, third);
    light.update(seen, {0, view}, kPx_m, true, pool);
    return static_cast<double>(light.at(facet, 0, second, third).w_m2_sr);
  }
  static constexpr double kPx_m = 0.144;
  TracedTarget target;
  WorkerPool pool;
  BodyLight body;
  LampView view;
  TexelLight light;
  Snapshot seen;
};

TEST(TexelLight, WallIsLitByTheFloorAsItsFormFactorSaysToTheCorner) {
  Texels texels(corner(), before_the_wall());
  const double leaving = 0.5 * 634.64 / kPi;
  // Down to a texel's width from the floor, where a patch of .3 m would be lost.
  for (const float h : {0.06F, 0.3F, 1.5F, 3.0F, 4.5F}) {
    double sum = 0;
    double want = 0;
    constexpr int kAcross = 60;
    for (int i = 0; i < kAcross; ++i) {
      const Vector3f place(0, -0.5F + static_cast<float>(i) / kAcross, h);
      for (std::uint32_t f = 2; f < 4; ++f) {
        const auto [second, third] = texels.target.facets.weights_at(f, place);
        if (second < 0.0F || third < 0.0F || second + third > 1.0F) continue;
        sum += texels.at(f, second, third) / kAcross;
      }
      want += 0.5 * leaving * wall_to_floor(static_cast<double>(h)) / kAcross;
    }
    // 21 texels of 64 rays each, one to a bin: where the floor ends in a bin, in some 16 of them,
    // chance has it, and leaves .7 % of what a floor all round would send.
    EXPECT_NEAR((sum - want) / (0.5 * leaving), 0.0, 0.02) << h;
  }
}

TEST(TexelLight, FirstRaysOfNeighboursStandForEachOther) {
  // On the wall 1.5 m up, with eight rays a texel: some alone, some among all their neighbours.
  const Snapshot snapshot = before_the_wall();
  struct Spread {
    double mean = 0;
    double rms = 0;
  };
  const auto ask = [&](bool neighbours) {
    Texels texels(corner(), snapshot);
    std::vector<Vector2f> places;
    for (float y = -5.0F; y < 2.0F; y += 0.5F) {
      const float third = 1.5F / 6.0F;
      places.emplace_back((y + 6.0F) / 12.0F - third, third);
    }
    const auto light = [&](const Vector2f& p) {
      return static_cast<double>(texels.light.at(2, 0, p.x(), p.y()).w_m2_sr);
    };
    for (const Vector2f& p : places) {
      (void)light(p);
      for (float dx = -0.02F; neighbours && dx < 0.02F; dx += 1e-3F)
        for (float dy = -0.04F; dy < 0.04F; dy += 2e-3F) (void)light(p + Vector2f(dx, dy));
    }
    texels.light.update(snapshot, {0, texels.view}, Texels::kPx_m, false, texels.pool);
    Spread spread;
    const auto n = static_cast<double>(places.size());
    for (const Vector2f& p : places) spread.mean += light(p) / n;
    for (const Vector2f& p : places) spread.rms += std::pow(light(p) - spread.mean, 2) / n;
    spread.rms = std::sqrt(spread.rms);
    return spread;
  };
  const Spread alone = ask(false);
  const Spread among = ask(true);
  EXPECT_LT(among.rms, 0.5 * alone.rms);
  const double want = 0.5 * 0.5 * 634.64 / kPi * wall_to_floor(1.5);
  EXPECT_NEAR(among.mean / want, 1.0, 0.03);
}

TEST(TexelLight, ManyAreMadeInSeveralFramesThoughAskedForOnce) {
  Texels texels(corner(), before_the_wall());
  for (float second = 0.0F; second < 1.0F; second += 2e-3F)
    for (float third = 0.0F; third < 1.0F - second; third += 2e-3F)
      for (const unsigned side : {0U, 1U}) (void)texels.light.at(2, side, second, third);
  std::vector<std::size_t> sizes;
  for (int i = 0; i < 6; ++i) {
    texels.light.update(texels.seen, {0, texels.view}, Texels::kPx_m, false, texels.pool);
    sizes.push_back(texels.light.size());
  }
  EXPECT_EQ(sizes[0], 8192U);
  EXPECT_GT(sizes[1], sizes[0]);
  EXPECT_LE(sizes[1], 2U * 8192U);
  EXPECT_EQ(sizes[5], sizes[4]);
}

TEST(TexelLight, OneThatIsLookedAtAgainIsUpToDateInTheNextFrame) {
  // Its lobe is wide enough to be kept by bins.
  Material foil{"grey", test_support::polyimide()};
  foil.wrinkle_rad = 15.0 * kDegree;
  Texels always(corner(), before_the_wall(), foil);
  Texels sometimes(corner(), before_the_wall(), foil);
  constexpr std::uint32_t kWall = 2;
  const auto look = [](Texels& texels) { return texels.light.at(kWall, 0, 0.3F, 0.3F).w_m2_sr; };
  (void)always.at(kWall, 0.3F, 0.3F);
  (void)sometimes.at(kWall, 0.3F, 0.3F);
  const auto frame_from = [](Texels& texels, double angle_rad) {
    texels.seen = before_the_wall({100e3 * std::cos(angle_rad), 100e3 * std::sin(angle_rad), 3});
    texels.light.update(texels.seen, {0, texels.view}, Texels::kPx_m, false, texels.pool);
  };
  // A degree a frame, and the camera stands still at last.
  for (int frame = 1; frame <= 50; ++frame) {
    for (Texels* texels : {&always, &sometimes})
      frame_from(*texels, std::min(frame, 40) * kPi / 180.0);
    (void)look(always);
  }
  // Nothing was done for it, and the view matters.
  EXPECT_GT(std::abs(look(sometimes) / look(always) - 1.0F), 0.02F);
  for (Texels* texels : {&always, &sometimes}) frame_from(*texels, 40.0 * kPi / 180.0);
  EXPECT_EQ(look(sometimes), look(always));
}

TEST(TexelLight, MoreTexelsThanThereIsRoomForAreMadeCoarser) {
  Texels texels(corner(), before_the_wall());
  // Pixels of a centimetre: 144 m^2 of texels of a third of that are 13 million.
  const auto look = [&] {
    for (int i = 0; i < 700; ++i)
      for (int k = 0; k < 700; ++k)
        for (std::uint32_t f = 0; f < 4; ++f)
          (void)texels.light.at(f, 0, static_cast<float>(i) / 700.0F,
                                static_cast<float>(k) / 700.0F);
    texels.light.update(texels.seen, {0, texels.view}, 0.01, false, texels.pool);
  };
  for (int frame = 0; frame < 12; ++frame) look();
  // It has come to rest: all that is looked at is there.
  const std::size_t kept = texels.light.size();
  EXPECT_GT(kept, 10'000U);
  look();
  EXPECT_EQ(texels.light.size(), kept);
}

TEST(TexelLight, PartsThatReachIntoOneAnotherDoNotDarkenTheSeam) {
  // The wall goes on below the floor: no camera sees that, and nothing lights it.
  Mesh sunk;
  add_plate(sunk, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(sunk, "grey", {0, -6, -0.03F}, {0, 12, 0}, {0, 0, 6.03F});
  const Snapshot from_above = before_the_wall({70e3, 0, 70e3});
  Texels whole(corner(), from_above);
  Texels reaching(sunk, from_above);
  const auto just_above = [](Texels& texels) {
    double sum = 0;
    for (int i = 0; i < 60; ++i) {
      const Vector3f place(0, -0.5F + static_cast<float>(i) / 60.0F, 0.002F);
      for (std::uint32_t f = 2; f < 4; ++f) {
        const auto [second, third] = texels.target.facets.weights_at(f, place);
        if (second >= 0.0F && third >= 0.0F && second + third <= 1.0F)
          sum += texels.at(f, second, third);
      }
    }
    return sum;
  };
  // Close to the floor both see half a hemisphere of it.
  EXPECT_NEAR(just_above(reaching) / just_above(whole), 1.0, 0.03);
}

}  // namespace
}  // namespace engine
