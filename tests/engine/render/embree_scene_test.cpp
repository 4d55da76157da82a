#include "engine/render/embree_scene.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "engine/render/facets.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Mesh square() {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  return mesh;
}

const Vector3f kAbove(0.1F, 0.2F, 5.0F);
const Vector3f kDown(0.0F, 0.0F, -1.0F);

/// Rays that Embree must never see.
std::vector<std::pair<Vector3f, Vector3f>> bad_rays() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  std::vector<std::pair<Vector3f, Vector3f>> rays;
  for (const float bad : {kNan, kInf, -kInf, 1e30F, -1e30F, std::numeric_limits<float>::max()}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vector3f origin = kAbove;
      origin[axis] = bad;
      rays.emplace_back(origin, kDown);
      Vector3f direction = kDown;
      direction[axis] = bad;
      rays.emplace_back(kAbove, direction);
    }
  }
  rays.emplace_back(kAbove, Vector3f::Zero());
  rays.emplace_back(kAbove, Vector3f(1e-30F, 0.0F, 0.0F));
  return rays;
}

TEST(EmbreeScene, RejectsAndCountsRaysThatAreNoRays) {
  const EmbreeScene scene(square());
  RayCounts counts;
  std::uint64_t given = 0;
  for (const auto& [origin, direction] : bad_rays()) {
    EXPECT_EQ(scene.intersect(origin, direction, counts).triangle, MeshHit::kNone);
    EXPECT_FALSE(scene.occluded(origin, direction, counts));
    given += 2;
    EXPECT_EQ(counts.rejected, given);
  }
  EXPECT_EQ(counts.rays, 0U);
  EXPECT_NE(scene.intersect(kAbove, kDown, counts).triangle, MeshHit::kNone);
  EXPECT_EQ(counts.rays, 1U);
}

TEST(EmbreeScene, RejectsThemInPacketsAndTracesTheRest) {
  const EmbreeScene scene(square());
  for (const auto& [origin, direction] : bad_rays()) {
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kLanes; lane += 2) rays.set(lane, kAbove, kDown);
    rays.set(3, origin, direction);
    rays.set(15, origin, direction);
    RayCounts counts;
    std::array<MeshHit, RayPacket::kLanes> hits;
    std::array<bool, RayPacket::kLanes> blocked;
    scene.intersect(rays, hits, counts);
    scene.occluded(rays, blocked, counts);
    EXPECT_EQ(counts.rays, 16U);
    EXPECT_EQ(counts.rejected, 4U);
    for (std::size_t lane = 0; lane < hits.size(); ++lane) {
      EXPECT_EQ(hits[lane].triangle != MeshHit::kNone, lane % 2 == 0) << lane;
      EXPECT_EQ(blocked[lane], lane % 2 == 0) << lane;
    }
  }
}

TEST(EmbreeScene, PacketAndSingleRaysAgree) {
  const Mesh mesh = test_support::sphere(5.0F, 60, 90, "white");
  const EmbreeScene scene(mesh);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  RayCounts one_by_one;
  RayCounts together;
  int hit_count = 0;
  for (int n = 0; n < 2000; ++n) {
    RayPacket rays;
    std::array<std::pair<Vector3f, Vector3f>, RayPacket::kLanes> single;
    for (int lane = 0; lane < RayPacket::kLanes; ++lane) {
      const Vector3f from(8.0F * unit(random), 8.0F * unit(random), 12.0F);
      const Vector3f along = Vector3f(0.1F * unit(random), 0.1F * unit(random), -1.0F).normalized();
      rays.set(lane, from, along);
      single[static_cast<std::size_t>(lane)] = {from, along};
    }
    std::array<MeshHit, RayPacket::kLanes> hits;
    std::array<bool, RayPacket::kLanes> blocked;
    scene.intersect(rays, hits, together);
    scene.occluded(rays, blocked, together);
    for (std::size_t lane = 0; lane < single.size(); ++lane) {
      const auto& [from, along] = single[lane];
      const MeshHit hit = scene.intersect(from, along, one_by_one);
      // On a shared edge either triangle will do.
      ASSERT_EQ(hit.triangle == MeshHit::kNone, hits[lane].triangle == MeshHit::kNone);
      ASSERT_EQ(scene.occluded(from, along, one_by_one), blocked[lane]);
      ASSERT_EQ(blocked[lane], hit.triangle != MeshHit::kNone);
      hit_count += blocked[lane] ? 1 : 0;
    }
  }
  EXPECT_EQ(one_by_one.rays, together.rays);
  EXPECT_GT(hit_count, 3000);
}

TEST(EmbreeScene, HitsThePlaceThatTheRayPointsAt) {
  const EmbreeScene scene(square());
  const Facets facets(square(), {Brdf(test_support::lambert(0.3), Brdf::Variant::kPhysical)});
  RayCounts counts;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-0.99F, 0.99F);
  for (int i = 0; i < 1000; ++i) {
    const Vector3f aim(unit(random), unit(random), 0.0F);
    const Vector3f along = (aim - kAbove).normalized();
    const MeshHit hit = scene.intersect(kAbove, along, counts);
    ASSERT_NE(hit.triangle, MeshHit::kNone);
    const SurfacePoint point = facets.at(hit, along);
    // Single precision at 5 m: 6e-7, a few of them.
    EXPECT_LT((point.place - aim).norm(), 3e-6F);
    EXPECT_EQ(point.normal, Vector3f(0.0F, 0.0F, 1.0F));
  }
}

TEST(EmbreeScene, MissesNothingThroughSharedEdgesAndCorners) {
  // A closed body from outside: no ray at a corner or the middle of an edge slips through.
  const Mesh mesh = test_support::sphere(5.0F, 100, 160, "white");
  const EmbreeScene scene(mesh);
  RayCounts counts;
  std::uint64_t missed = 0;
  std::uint64_t aimed = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vector3f& a = mesh.vertices[t.corner[0]];
    const Vector3f& b = mesh.vertices[t.corner[1]];
    for (const Vector3f& at : {a, Vector3f(0.5F * (a + b))}) {
      if (at.z() < 0.5F) continue;  // the half that is seen
      const Vector3f from(0.0F, 0.0F, 6.0F * 5.0F);
      const Vector3f along = (at - from).normalized();
      if (along.dot(at.normalized()) > -0.05F) continue;  // not the outline
      ++aimed;
      missed += scene.intersect(from, along, counts).triangle == MeshHit::kNone ? 1U : 0U;
    }
  }
  EXPECT_GT(aimed, 10000U);
  EXPECT_EQ(missed, 0U);
}

TEST(EmbreeScene, ConvexBodyNeverShadesItself) {
  // Rays from 100 km away, moved up to the body in double; shadow rays leave as Facets starts them.
  const Mesh mesh = test_support::sphere(5.0F, 200, 400, "white");
  const EmbreeScene scene(mesh);
  const Facets facets(mesh, {Brdf(test_support::lambert(0.3), Brdf::Variant::kPhysical)});
  std::mt19937_64 random(3);
  std::normal_distribution<double> axis;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  RayCounts counts;
  int shaded = 0;
  int missed = 0;
  int tested = 0;
  double furthest_m = 0;
  constexpr int kRays = 100000;
  for (int i = 0; i < kRays; ++i) {
    const Vector3d from = 100e3 * Vector3d(axis(random), axis(random), axis(random)).normalized();
    const Vector3d aim = 4.9 * Vector3d(unit(random), unit(random), unit(random)).normalized() *
                         std::cbrt(std::abs(unit(random)));
    const Vector3d along = (aim - from).normalized();
    const Vector3d near = from + (from.norm() - 6.0) * along;
    const MeshHit hit = scene.intersect(near.cast<float>(), along.cast<float>(), counts);
    if (hit.triangle == MeshHit::kNone) {
      ++missed;
      continue;
    }
    const SurfacePoint point = facets.at(hit, along.cast<float>());
    const Vector3d off = point.place.cast<double>() - from;
    furthest_m = std::max(furthest_m, (off - off.dot(along) * along).norm());
    // Any lamp above the facet's own plane, down to 1e-3 rad.
    Vector3d lamp = Vector3d(axis(random), axis(random), axis(random)).normalized();
    const Vector3d normal = point.normal.cast<double>();
    if (lamp.dot(normal) < 0.0) lamp = -lamp;
    if (lamp.dot(normal) < 1e-3) continue;
    ++tested;
    shaded += scene.occluded(point.start(), lamp.cast<float>(), counts) ? 1 : 0;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_GT(tested, kRays * 9 / 10);
  EXPECT_EQ(shaded, 0);
  // 1e-4 px at 100 km are 1.4e-5 m; grazing rays stretch single precision most.
  EXPECT_LT(furthest_m, 1.4e-5);
  EXPECT_EQ(counts.rejected, 0U);
}

TEST(EmbreeScene, TracesTheGoodFaceAmongBadOnes) {
  // Zero area, duplicates and a sliver, as a file may hold them.
  Mesh mesh = square();
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.triangles.push_back({{0, 0, 1}, 0});
  mesh.vertices.emplace_back(1.0F, 1e-30F, 0.0F);
  mesh.triangles.push_back({{0, 1, 4}, 0});
  const EmbreeScene scene(mesh);
  RayCounts counts;
  EXPECT_NE(scene.intersect(kAbove, kDown, counts).triangle, MeshHit::kNone);
  EXPECT_TRUE(scene.occluded(kAbove, kDown, counts));
  EXPECT_FALSE(scene.occluded(kAbove, -kDown, counts));
}

}  // namespace
}  // namespace engine
