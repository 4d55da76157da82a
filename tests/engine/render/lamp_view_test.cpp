#include "engine/render/lamp_view.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/render/traced_target.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test_support::add_plate;
using test_support::lambert_material;

TEST(LampView, TellsLightFromShadowOnAFloor) {
  Mesh mesh;
  add_plate(mesh, "grey", {-4, -4, 0}, {8, 0, 0}, {0, 8, 0});
  add_plate(mesh, "grey", {-1, -1, 3}, {2, 0, 0}, {0, 2, 0});
  LampView view(mesh);
  WorkerPool pool(1);
  view.update({0, 0, 1}, pool);
  const auto at = [&](float x, float y) {
    const Eigen::Vector2f p = view.on_map({x, y, 0});
    return view.places(x > y ? 0 : 1, p, p);
  };
  const auto on_small = [&] {
    const Eigen::Vector2f p = view.on_map({0.5F, 0.2F, 3});
    return view.places(2, p, p);
  };
  EXPECT_EQ(on_small(), Lit::kYes);
  EXPECT_EQ(at(3.0F, 1.0F), Lit::kYes);
  EXPECT_EQ(at(1.0F, 3.0F), Lit::kYes);
  EXPECT_EQ(at(0.5F, 0.2F), Lit::kNo);
  EXPECT_EQ(at(1.0F, 0.2F), Lit::kUnknown);  // on the shadow's edge
  // From below the small plate lies in the floor's shadow.
  view.update({0, 0, -1}, pool);
  EXPECT_EQ(at(0.5F, 0.2F), Lit::kYes);
  EXPECT_EQ(on_small(), Lit::kNo);
  view.update(Vector3d::Constant(std::nan("")), pool);
  EXPECT_EQ(on_small(), Lit::kUnknown);
  EXPECT_NE(at(3.0F, 1.0F), Lit::kYes);
}

/// What a map tells of places, against the ray that it saves.
struct Told {
  int places = 0;
  int lit = 0;
  int unknown = 0;
  int lit_but_dark = 0;
  int dark_but_lit = 0;
};

/// Of places of the first `facets` whose normal on side 0 looks to the lamp, and which `takes`
/// takes.
template <typename Takes>
Told told(const Mesh& mesh, const TracedTarget& target, const Vector3d& toward,
          std::uint32_t facets, Takes takes) {
  WorkerPool pool(1);
  LampView view(mesh);
  view.update(toward, pool);
  const Vector3f lamp = (1e3 * toward).array().round().matrix().normalized().cast<float>();
  Told all;
  RayCounts counts;
  const std::uint32_t a_facet = facets > 2 ? 64 : 4096;
  for (std::uint32_t f = 0; f < facets; ++f) {
    for (std::uint32_t i = 0; i < a_facet; ++i) {
      // Roberts' R2 sequence, folded into the triangle.
      float second = static_cast<float>(std::fmod(0.7548776662 * (i + 1), 1.0));
      float third = static_cast<float>(std::fmod(0.5698402910 * (i + 1), 1.0));
      if (second + third > 1.0F) {
        second = 1.0F - second;
        third = 1.0F - third;
      }
      const SurfacePoint place = target.facets.on_side(f, second, third, 0);
      if (place.normal.dot(lamp) <= 0.0F || !takes(place)) continue;
      const Eigen::Vector2f on_map = view.on_map(place.place);
      const Lit lit = view.places(f, on_map, on_map);
      const bool dark = target.scene.occluded(place.start(), lamp, counts);
      ++all.places;
      all.lit += dark ? 0 : 1;
      all.unknown += lit == Lit::kUnknown ? 1 : 0;
      all.lit_but_dark += lit == Lit::kYes && dark ? 1 : 0;
      all.dark_but_lit += lit == Lit::kNo && !dark ? 1 : 0;
    }
  }
  return all;
}

std::uint32_t facets_of(const Mesh& mesh) {
  return static_cast<std::uint32_t>(mesh.triangles.size());
}
bool any_place(const SurfacePoint& /*place*/) { return true; }

TEST(LampView, TellsOfTheTelescopeWhatRaysDo) {
  const Mesh mesh = telescope_mesh();
  const TracedTarget target(mesh, test_support::telescope_materials());
  for (const Vector3d& toward : {Vector3d(0.9, 0.5, 0.1), Vector3d(-0.3, 0.2, 0.93),
                                 Vector3d(0.05, 0.99, -0.12), Vector3d(1.0, 0.02, 0.03)}) {
    SCOPED_TRACE(toward.transpose());
    const Told all = told(mesh, target, toward.normalized(), facets_of(mesh), any_place);
    EXPECT_GT(all.lit, all.places / 4);
    EXPECT_LT(all.unknown, all.places / 2);
    EXPECT_LT(all.lit_but_dark, all.places / 1000);
    EXPECT_LT(all.dark_but_lit, all.places / 1000);
  }
}

TEST(LampView, HalfOfARectangleOnAShadowsEdgeIsLit) {
  // A plate of 2 m stands 1 m above a floor, the lamp straight above: its edge is at x = 1.
  Mesh mesh;
  add_plate(mesh, "grey", {-6, -6, 0}, {12, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {-1, -1, 1}, {2, 0, 0}, {0, 2, 0});
  LampView view(mesh);
  WorkerPool pool(1);
  view.update({0, 0, 1}, pool);
  const auto share = [&](float x) {
    // 10 cm wide: six steps of the map.
    const Eigen::Vector2f a = view.on_map({x - 0.05F, 0.0F, 0.0F});
    const Eigen::Vector2f b = view.on_map({x + 0.05F, 0.1F, 0.0F});
    // Facet 0 and 1 are the floor's.
    return view.lit_share(0, a.cwiseMin(b), a.cwiseMax(b));
  };
  EXPECT_EQ(share(2.0F), 1.0F);
  EXPECT_EQ(share(0.5F), 0.0F);
  EXPECT_NEAR(share(1.0F), 0.5F, 0.15F);
  EXPECT_NEAR(share(0.975F), 0.25F, 0.15F);
  EXPECT_TRUE(std::isnan(share(100.0F)));
}

/// A floor with tiles of 5 mm in a raster, 5 cm apart, as cells lie on a panel.
Mesh tiles() {
  Mesh mesh;
  add_plate(mesh, "grey", {-6, -6, 0}, {12, 0, 0}, {0, 12, 0});
  constexpr float kTile_m = 0.6F;
  constexpr float kHigh_m = 5e-3F;
  for (float x = -5.0F; x < 5.0F; x += kTile_m + 0.05F) {
    for (float y = -5.0F; y < 5.0F; y += kTile_m + 0.05F) {
      add_plate(mesh, "grey", {x, y, kHigh_m}, {kTile_m, 0, 0}, {0, kTile_m, 0});
      add_plate(mesh, "grey", {x, y, 0}, {kTile_m, 0, 0}, {0, 0, kHigh_m});
      add_plate(mesh, "grey", {x, y, 0}, {0, 0, kHigh_m}, {0, kTile_m, 0});
      add_plate(mesh, "grey", {x + kTile_m, y, 0}, {0, kTile_m, 0}, {0, 0, kHigh_m});
      add_plate(mesh, "grey", {x, y + kTile_m, 0}, {0, 0, kHigh_m}, {kTile_m, 0, 0});
    }
  }
  return mesh;
}

TEST(LampView, FindsTheShadowsOfLowStepsInGrazingLight) {
  // A map that allows a plane too much for its slope sees the floor's strips lit between the tiles
  // that shade them.
  const Mesh mesh = tiles();
  const TracedTarget target(mesh, {lambert_material("grey", 0.5)});
  const auto strips = [](const SurfacePoint& place) {
    const auto in_strip = [](float x) { return std::fmod(x + 5.0F, 0.65F) > 0.6F; };
    return place.place.head<2>().cwiseAbs().maxCoeff() < 4.5F &&
           (in_strip(place.place.x()) || in_strip(place.place.y()));
  };
  for (const double elevation_deg : {1.5, 3.0, 5.0, 12.0}) {
    SCOPED_TRACE(elevation_deg);
    const double e = elevation_deg * kDegree;
    const Vector3d toward(std::cos(e) * 0.6, std::cos(e) * 0.8, std::sin(e));
    const Told all = told(mesh, target, toward, 2, strips);
    EXPECT_GT(all.places, 500);
    EXPECT_EQ(all.lit_but_dark, 0);
    EXPECT_LE(all.dark_but_lit, 2);
  }
}

TEST(LampView, LeavesTheFloorsOfHollowsLit) {
  // Grooves of 8 mm, of which a step of the map holds more than one: of a groove's floor, the walls
  // stand above the plane almost everywhere.
  Mesh mesh;
  constexpr float kDeep_m = 6e-3F;
  for (int i = -60; i < 60; ++i) {
    const float x = 8e-3F * static_cast<float>(i);
    add_plate(mesh, "grey", {x, -0.5F, 0}, {3.8e-3F, 0, -kDeep_m}, {0, 1, 0});
    add_plate(mesh, "grey", {x + 3.8e-3F, -0.5F, -kDeep_m}, {4e-4F, 0, 0}, {0, 1, 0});
    add_plate(mesh, "grey", {x + 4.2e-3F, -0.5F, -kDeep_m}, {3.8e-3F, 0, kDeep_m}, {0, 1, 0});
  }
  add_plate(mesh, "grey", {0, 6, -1}, {1, 0, 0}, {0, 0.5F, 0});  // the size of the map
  const TracedTarget target(mesh, {lambert_material("grey", 0.5)});
  const Told all =
      told(mesh, target, Vector3d(0.2, 0.1, 1.0).normalized(), facets_of(mesh), any_place);
  EXPECT_EQ(all.lit, all.places);
  EXPECT_EQ(all.dark_but_lit, 0);
}

}  // namespace
}  // namespace engine
