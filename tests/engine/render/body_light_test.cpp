#include "engine/render/body_light.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/render/facet_nodes.h"
#include "engine/render/lamp_view.h"
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
      const Vector3f d =
          HemisphereBins::direction(bin, (static_cast<float>(i % kSteps) + 0.5F) / kSteps,
                                    (static_cast<float>(i / kSteps) + 0.5F) / kSteps);
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

TEST(BodyLight, WallIsLitByTheFloorAsItsFormFactorSays) {
  const TracedTarget target(corner(), {lambert_material("grey", 0.5)});
  WorkerPool pool(1);
  BodyLight light(target, 1, pool);
  FacetNodes nodes(target, light.patches());
  Snapshot snapshot = test_support::view_from({100e3, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {direction_of<BodyFrame>({0, 0, 1}), 634.64};
  light.light_up(snapshot, pool);
  nodes.update(light.to_camera(), snapshot.camera.m, pool);
  // From a place at height h on the wall's middle line to the floor, 2a wide and d deep: Howell's
  // C-3 for a plane element beside a corner of a rectangle at a right angle, twice.
  const auto form_factor = [](double h, double a, double d) {
    const double x = a / h;
    const double y = d / h;
    const double beside =
        (std::atan(x) - std::atan(x / std::sqrt(1.0 + y * y)) / std::sqrt(1.0 + y * y));
    return 2.0 * beside / (2.0 * kPi);
  };
  const double leaving = 0.5 * 634.64 / kPi;
  for (const double h : {1.5, 3.0, 4.5}) {
    const SurfacePoint place{{0, 0, static_cast<float>(h)}, {1, 0, 0}, 0, 1e-5F};
    const std::uint32_t own = light.patches().at(place);
    ASSERT_NE(own, SurfacePatches::kNone);
    double mean = 0;
    for (std::uint32_t f = 2; f < 4; ++f) {
      const auto [second, third] = target.facets.weights_at(f, place.place);
      if (second < -1e-5F || third < -1e-5F || second + third > 1.0F + 1e-5F) continue;
      mean = static_cast<double>(nodes.at(f, second, third, light.to_camera()[own]));
    }
    const double want = 0.5 * leaving * form_factor(h, 6.0, 8.0);
    // 512 fixed rays of which a fifth meet the floor, and the mean of some four patches: 5 %.
    EXPECT_NEAR(mean / want, 1.0, 0.15) << h;
  }
}

TEST(LampView, TellsLightFromShadowOnAFloor) {
  Mesh mesh;
  add_plate(mesh, "grey", {-4, -4, 0}, {8, 0, 0}, {0, 8, 0});
  add_plate(mesh, "grey", {-1, -1, 3}, {2, 0, 0}, {0, 2, 0});
  LampView view(mesh);
  WorkerPool pool(1);
  view.update({0, 0, 1}, pool);
  const auto at = [&](float x, float y) {
    const Vector2f p = view.on_map({x, y, 0});
    return view.places(x > y ? 0 : 1, p, p);
  };
  EXPECT_EQ(view.facet(0), Lit::kUnknown);
  EXPECT_EQ(view.facet(2), Lit::kYes);
  EXPECT_EQ(at(3.0F, 1.0F), Lit::kYes);
  EXPECT_EQ(at(1.0F, 3.0F), Lit::kYes);
  EXPECT_EQ(at(0.5F, 0.2F), Lit::kNo);
  EXPECT_EQ(at(1.0F, 0.2F), Lit::kUnknown);  // on the shadow's edge
  // From below the small plate lies in the floor's shadow.
  view.update({0, 0, -1}, pool);
  EXPECT_EQ(view.facet(0), Lit::kYes);
  EXPECT_EQ(view.facet(2), Lit::kNo);
  view.update(Vector3d::Constant(std::nan("")), pool);
  EXPECT_EQ(view.facet(0), Lit::kUnknown);
  EXPECT_NE(at(3.0F, 1.0F), Lit::kYes);
}

}  // namespace
}  // namespace engine
