#include "engine/scene/simplified_mesh.h"

#include <algorithm>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/render/facets.h"
#include "engine/scene/nearest_facet.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const std::vector<Material> kWhite = {test_support::lambert_material("white", 0.5)};

/// A square plate of `side_m` in 2 n^2 triangles, its inner vertices off by so much.
Mesh wrinkled_plate(int n, float side_m, double rms_m, const std::string& material) {
  Mesh mesh;
  const std::uint32_t id = mesh.material(material);
  std::mt19937_64 random(1);
  std::normal_distribution<double> height(0.0, rms_m > 0.0 ? rms_m : 1.0);
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const bool inner = rms_m > 0.0 && i > 0 && j > 0 && i < n && j < n;
      mesh.vertices.emplace_back(side_m * (static_cast<float>(i) / static_cast<float>(n) - 0.5F),
                                 side_m * (static_cast<float>(j) / static_cast<float>(n) - 0.5F),
                                 inner ? static_cast<float>(height(random)) : 0.0F);
    }
  }
  const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, id});
      mesh.triangles.push_back({{at(i, j), at(i + 1, j + 1), at(i, j + 1)}, id});
    }
  }
  return mesh;
}

double area_m2(const Mesh& mesh) {
  double sum = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vector3f& a = mesh.vertices[t.corner[0]];
    sum += 0.5 * static_cast<double>(
                     (mesh.vertices[t.corner[1]] - a).cross(mesh.vertices[t.corner[2]] - a).norm());
  }
  return sum;
}

TEST(NearestFacet, FindsWhatATryOfAllFinds) {
  const Mesh ball = test_support::sphere(1.0F, 16, 32, "white");
  const NearestFacet nearest(ball, 0.2);
  std::mt19937_64 random(1);
  std::normal_distribution<float> axis;
  for (int i = 0; i < 200; ++i) {
    const Vector3f outward = Vector3f(axis(random), axis(random), axis(random)).normalized();
    const Vector3f point = (0.85F + 0.0015F * static_cast<float>(i)) * outward;
    const NearestFacet::Place found = nearest.find(point, outward, 0);
    // The nearest of many places on each triangle is a bound from above.
    float least_m = 1e9F;
    for (const Mesh::Triangle& t : ball.triangles) {
      for (int u = 0; u <= 8; ++u) {
        for (int v = 0; u + v <= 8; ++v) {
          const Vector3f place = (ball.vertices[t.corner[0]] * static_cast<float>(8 - u - v) +
                                  ball.vertices[t.corner[1]] * static_cast<float>(u) +
                                  ball.vertices[t.corner[2]] * static_cast<float>(v)) /
                                 8.0F;
          least_m = std::min(least_m, (place - point).norm());
        }
      }
    }
    if (least_m > 0.19F) continue;
    ASSERT_NE(found.triangle, NearestFacet::kNone);
    const auto& corner = ball.triangles[found.triangle].corner;
    const Vector3f place = ball.vertices[corner[0]] * (1.0F - found.second - found.third) +
                           ball.vertices[corner[1]] * found.second +
                           ball.vertices[corner[2]] * found.third;
    EXPECT_NEAR((place - point).norm(), found.distance_m, 1e-6F);
    EXPECT_LE(found.distance_m, least_m + 1e-6F);
    // Places lie an eighth of an edge of .2 m apart at most.
    EXPECT_GE(found.distance_m, std::max(0.0F, least_m - 0.025F));
  }
}

TEST(NearestFacet, FindsNothingOutOfReachNorOfAnotherMaterial) {
  const Mesh ball = test_support::sphere(1.0F, 16, 32, "white");
  const NearestFacet nearest(ball, 0.1);
  EXPECT_EQ(nearest.find({1.2F, 0, 0}, {1, 0, 0}, 0).triangle, NearestFacet::kNone);
  EXPECT_EQ(nearest.find({1.0F, 0, 0}, {1, 0, 0}, 1).triangle, NearestFacet::kNone);
  EXPECT_NE(nearest.find({1.05F, 0, 0}, {1, 0, 0}, 0).triangle, NearestFacet::kNone);
}

TEST(NearestFacet, OfAThinPlateItIsTheSideThatFacesAlike) {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  test_support::add_plate(mesh, "white", {-1, -1, -0.01F}, {0, 2, 0}, {2, 0, 0});
  const NearestFacet nearest(mesh, 0.1);
  EXPECT_LT(nearest.find({0.3F, 0.2F, -0.008F}, {0, 0, 1}, 0).triangle, 2U);
  EXPECT_GE(nearest.find({0.3F, 0.2F, -0.002F}, {0, 0, -1}, 0).triangle, 2U);
}

TEST(MeshSimplifier, SurfacesDifferByNoMoreThanAskedFor) {
  const Mesh ball = test_support::sphere(5.0F, 60, 120, "white");
  const MeshSimplifier simplifier(ball, kWhite);
  std::size_t last = ball.triangles.size();
  for (const double rms_m : {0.002, 0.005, 0.02}) {
    const SimplifiedMesh coarse = simplifier.to(rms_m);
    EXPECT_LT(coarse.mesh.triangles.size(), last) << rms_m;
    last = coarse.mesh.triangles.size();
    EXPECT_LE(coarse.rms_m, rms_m);
    // By the ball itself: every place of a facet is as far from it as its radius says. The mean
    // over the facets' own area, and over the ball's, differ by what the facets are smaller.
    double squares = 0;
    double area = 0;
    const Mesh& m = coarse.mesh;
    for (const Mesh::Triangle& t : m.triangles) {
      const Vector3f& a = m.vertices[t.corner[0]];
      const Vector3f& b = m.vertices[t.corner[1]];
      const Vector3f& c = m.vertices[t.corner[2]];
      const double each = static_cast<double>((b - a).cross(c - a).norm()) / 6.0;
      for (const Vector3f& place :
           {Vector3f((4.0F * a + b + c) / 6.0F), Vector3f((a + 4.0F * b + c) / 6.0F),
            Vector3f((a + b + 4.0F * c) / 6.0F)}) {
        squares += each * std::pow(static_cast<double>(place.norm()) - 5.0, 2);
        area += each;
      }
    }
    // The ball of 60 rings is itself up to 2 mm inside.
    EXPECT_LE(std::sqrt(squares / area), rms_m + 0.002) << rms_m;
    EXPECT_NEAR(area / area_m2(ball), 1.0, 0.005) << rms_m;
  }
}

TEST(MeshSimplifier, WhatIsFlatBecomesAFewTriangles) {
  const Mesh plate = wrinkled_plate(32, 4.0F, 0.0, "white");
  const SimplifiedMesh coarse = MeshSimplifier(plate, kWhite).to(1e-4);
  EXPECT_LE(coarse.mesh.triangles.size(), 8U);
  EXPECT_NEAR(area_m2(coarse.mesh), 16.0, 1e-3);
}

TEST(MeshSimplifier, AWrinkledPlateLiesWhereItsMeanLies) {
  // A vertex that were kept as it is would carry its own wrinkle of 2 mm: the mean height of 1000
  // independent ones is .06 mm rms off, that of the few that stay must not be ten times that.
  Mesh plate = wrinkled_plate(32, 4.0F, 2e-3, "white");
  for (Vector3f& v : plate.vertices) v.z() += 1.0F;
  const SimplifiedMesh coarse = MeshSimplifier(plate, kWhite).to(2.2e-3);
  ASSERT_LE(coarse.mesh.triangles.size(), 700U);
  double height = 0;
  for (const Mesh::Triangle& t : coarse.mesh.triangles) {
    const Vector3f& a = coarse.mesh.vertices[t.corner[0]];
    const Vector3f& b = coarse.mesh.vertices[t.corner[1]];
    const Vector3f& c = coarse.mesh.vertices[t.corner[2]];
    height += static_cast<double>((b - a).cross(c - a).norm()) / 6.0 *
              (static_cast<double>(a.z() + b.z() + c.z()) - 3.0);
  }
  EXPECT_NEAR(height / area_m2(coarse.mesh), 0.0, 3e-4);
}

TEST(MeshSimplifier, MaterialsKeepTheirAreas) {
  Mesh mesh = wrinkled_plate(32, 4.0F, 0.0, "white");
  const std::uint32_t black = mesh.material("black");
  for (Mesh::Triangle& t : mesh.triangles)
    if (mesh.vertices[t.corner[0]].x() < -0.5F) t.material = black;
  const std::vector<Material> both = {kWhite[0], test_support::lambert_material("black", 0.1)};
  const SimplifiedMesh coarse = MeshSimplifier(mesh, both).to(1e-3);
  ASSERT_EQ(coarse.surfaces.size(), 2U);
  const auto share = [&](const Mesh& m, const std::string& name) {
    Mesh part = m;
    std::erase_if(part.triangles,
                  [&](const Mesh::Triangle& t) { return m.material_names[t.material] != name; });
    return area_m2(part) / area_m2(m);
  };
  for (const char* name : {"white", "black"})
    EXPECT_NEAR(share(coarse.mesh, name), share(mesh, name), 1e-3) << name;
}

TEST(MeshSimplifier, GlintsOfAWrinkledPlateStayAsWideAndAsStrong) {
  // Light of a plate of foil, 3 deg of wrinkles, while the Sun passes the mirror direction.
  const std::vector<Material> foil = {{"foil", test_support::silicon()}};
  const Mesh plate = wrinkled_plate(32, 3.2F, 6e-3, "foil");
  const SimplifiedMesh coarse = MeshSimplifier(plate, foil).to(7e-3);
  ASSERT_LE(coarse.mesh.triangles.size(), plate.triangles.size() / 3);
  const auto facets_of = [](const Mesh& mesh, const std::vector<Material>& materials) {
    std::vector<Brdf> brdfs;
    for (const Material& m : materials) brdfs.push_back(m.brdf());
    return Facets(mesh, std::move(brdfs));
  };
  const auto light = [](Facets& facets, const Mesh& mesh, double off_deg) {
    Snapshot view = test_support::look_at_origin({0, 0, 1e5}, {0, 1, 0});
    view.sun = {direction_of<BodyFrame>(Vector3d(std::tan(off_deg * kDegree), 0, 1)), 600.0};
    facets.light_up(view);
    double sum = 0;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      sum += static_cast<double>(facets.radiance(t)[0] * facets.on_side(t, 0, 0, 0).normal.z()) *
             facets.area_m2(t);
    return sum;
  };
  std::vector<Material> not_widened = coarse.materials;
  for (Material& m : not_widened) m.wrinkle_rad = 0;
  Facets fine = facets_of(plate, foil);
  Facets wide = facets_of(coarse.mesh, coarse.materials);
  Facets narrow = facets_of(coarse.mesh, not_widened);
  double wide_off = 0;
  double narrow_off = 0;
  for (const double off_deg : {0.0, 4.0, 8.0, 12.0}) {
    const double want = light(fine, plate, off_deg);
    wide_off = std::max(wide_off, std::abs(light(wide, coarse.mesh, off_deg) / want - 1.0));
    narrow_off = std::max(narrow_off, std::abs(light(narrow, coarse.mesh, off_deg) / want - 1.0));
  }
  // The header's tens of per cent; what is not widened is off by more than all of it.
  EXPECT_LT(wide_off, 0.5);
  EXPECT_GT(narrow_off, 1.0);
}

TEST(MeshSimplifier, WhatCannotBeSimplifiedStaysAsItIs) {
  Mesh none;
  static_cast<void>(none.material("white"));
  EXPECT_TRUE(MeshSimplifier(none, kWhite).to(1.0).mesh.triangles.empty());
  Mesh one = none;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{{0, 1, 2}, 0}};
  EXPECT_EQ(MeshSimplifier(one, kWhite).to(1e-3).mesh.triangles.size(), 1U);
  // Slivers without area, and all at one place.
  Mesh slivers = none;
  for (int i = 0; i < 30; ++i) slivers.vertices.emplace_back(static_cast<float>(i / 3), 0.0F, 0.0F);
  for (std::uint32_t i = 0; i < 10; ++i)
    slivers.triangles.push_back({{3 * i, (3 * i + 4) % 30, (3 * i + 8) % 30}, 0});
  static_cast<void>(MeshSimplifier(slivers, kWhite).to(1e-3));
  for (Vector3f& v : slivers.vertices) v.setZero();
  static_cast<void>(MeshSimplifier(slivers, kWhite).to(1e-3));
  // Triangles that share nothing.
  Mesh loose = wrinkled_plate(8, 1.0F, 0.0, "white");
  Mesh apart = none;
  for (const Mesh::Triangle& t : loose.triangles) {
    const auto first = static_cast<std::uint32_t>(apart.vertices.size());
    for (const std::uint32_t c : t.corner)
      apart.vertices.emplace_back(loose.vertices[c] +
                                  Vector3f(0, 0, 0.05F * static_cast<float>(first)));
    apart.triangles.push_back({{first, first + 1, first + 2}, 0});
  }
  EXPECT_NEAR(area_m2(MeshSimplifier(apart, kWhite).to(1e-4).mesh), 1.0, 0.01);
}

TEST(MeshSimplifier, AMaterialThatIsNotThereIsAnError) {
  EXPECT_THROW(MeshSimplifier(wrinkled_plate(2, 1.0F, 0.0, "gold"), kWhite), ConfigError);
}

}  // namespace
}  // namespace engine
