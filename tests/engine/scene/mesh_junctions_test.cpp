#include "engine/scene/mesh_junctions.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/obj_text.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test_support::load_obj;
using test_support::LoadedObj;

/// Each with corners of its own.
Mesh soup(const std::vector<Vector3f>& corners) {
  Mesh mesh;
  mesh.vertices = corners;
  for (std::uint32_t i = 0; i + 2 < corners.size(); i += 3)
    mesh.triangles.push_back({{i, i + 1, i + 2}, mesh.material("white")});
  return mesh;
}

MeshJunctions junctions_of(const Mesh& mesh, double weld_m) {
  return junctions_of(mesh, MeshTopology(mesh), weld_m);
}

TEST(MeshJunctions, AreNoneOfOpenEdgesThatMeetAtTheirEnds) {
  // A cube without its lid.
  const LoadedObj box = load_obj(std::string(test_support::kCubeCorners) +
                                 "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  EXPECT_EQ(box.report.open_edges.count, 4U);
  EXPECT_EQ(box.report.t_junctions, MeshDefect());
  EXPECT_TRUE(box.report.t_junctions_complete);
}

TEST(MeshJunctions, AreToldWithTheLineOfTheFaceWhoseEdgeTheyAreIn) {
  // Below, one edge three long; above it three faces, of which only the outer two share its ends.
  const LoadedObj wall = load_obj(
      "v 0 0 0\nv 3 0 0\nv 3 -1 0\nv 0 -1 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 3 1 0\n"
      "f 1 5 8 7\nf 5 6 9 8\nf 4 3 2 1\nf 6 2 10 9\n");
  EXPECT_EQ(wall.report.t_junctions.count, 2U);
  EXPECT_EQ(wall.report.t_junctions.lines, std::vector<std::uint32_t>{13});
  const std::vector<std::string> remarks = wall.report.remarks();
  EXPECT_NE(
      std::ranges::find(remarks, "2 vertices in the middle of another face's open edge (line 13)"),
      remarks.end());
}

TEST(MeshJunctions, AreWithinTheWeldOfAnEdgeAndNoFurther) {
  constexpr double kWeld_m = 1.0 / 1024;
  // Heights that floats have: at the weld, and one step beyond; before and behind the edge's end.
  const auto count = [&](const Vector3f& p) {
    const Mesh mesh = soup({{0, 0, 0}, {2, 0, 0}, {1, -1, 0}, p, {1.5F, 2, 0}, {1, 2, 1}});
    return junctions_of(mesh, kWeld_m).found.size();
  };
  const auto weld_m = static_cast<float>(kWeld_m);
  const float beyond_m = std::nextafter(weld_m, 1.0F);
  EXPECT_EQ(count({1, 0, 0}), 1U);
  EXPECT_EQ(count({1, weld_m, 0}), 1U);
  EXPECT_EQ(count({1, 0, -weld_m}), 1U);
  EXPECT_EQ(count({1, beyond_m, 0}), 0U);
  EXPECT_EQ(count({1, 0, beyond_m}), 0U);
  EXPECT_EQ(count({1, weld_m, weld_m}), 0U);  // in the edge's box, that much wider
  EXPECT_EQ(count({2 + 2 * weld_m, 0, 0}), 0U);
  EXPECT_EQ(count({2 - 2 * weld_m, 0, 0}), 1U);
}

TEST(MeshJunctions, AreWhatComparingAllVerticesWithAllEdgesFinds) {
  constexpr double kWeld_m = 0.01;
  std::minstd_rand chance(11);
  std::uniform_real_distribution<float> where(0.0F, 1.0F);
  std::vector<Vector3f> corners(900);
  for (Vector3f& p : corners) p = {where(chance), where(chance), where(chance)};
  const Mesh mesh = soup(corners);
  std::vector<std::uint32_t> want;
  for (std::uint32_t v = 0; v < corners.size(); ++v) {
    bool meets = false;
    for (std::uint32_t k = 0; k < corners.size() && !meets; ++k) {
      const Vector3d a = corners[k].cast<double>();
      const Vector3d along = corners[k % 3 == 2 ? k - 2 : k + 1].cast<double>() - a;
      const Vector3d to = corners[v].cast<double>() - a;
      const double at = to.dot(along.normalized());
      meets = v / 3 != k / 3 && at > 0 && at < along.norm() &&
              to.cross(along.normalized()).norm() <= kWeld_m;
    }
    if (meets) want.push_back(v);
  }
  const MeshJunctions junctions = junctions_of(mesh, kWeld_m);
  std::vector<std::uint32_t> got;
  for (const MeshJunctions::Junction& junction : junctions.found) got.push_back(junction.vertex);
  // Near an edge's end the distance is that of the end, which here may be as close.
  for (const std::uint32_t v : want) EXPECT_TRUE(std::ranges::binary_search(got, v)) << v;
  EXPECT_GT(want.size(), 50U);
  EXPECT_LE(got.size(), want.size() + want.size() / 10);
}

TEST(MeshJunctions, AreFoundOfHostileMeshesInStepsThatAreCounted) {
  constexpr int kTriangles = 20'000;
  // All on one line: nearly every vertex is in some edge.
  std::minstd_rand chance(13);
  std::uniform_real_distribution<float> where(0.0F, 1.0F);
  std::vector<Vector3f> corners(3 * kTriangles);
  for (Vector3f& p : corners) p = Vector3f(where(chance), 0, 0);
  const MeshJunctions line = junctions_of(soup(corners), 1e-9);
  EXPECT_TRUE(line.complete);
  EXPECT_GT(line.found.size(), 2U * kTriangles);
  // All edges side by side across all boxes, and no vertex in one: it gives up, and says so.
  corners.clear();
  for (int i = 0; i < kTriangles; ++i) {
    const float off = 1e-5F * static_cast<float>(i);
    corners.emplace_back(0.0F, off, 0.0F);
    corners.emplace_back(1.0F, 1.0F + off, 1.0F);
    corners.emplace_back(0.5F, 0.5F - off, 0.5F);
  }
  const MeshJunctions bundle = junctions_of(soup(corners), 1e-9);
  EXPECT_FALSE(bundle.complete);
  MeshReport report;
  report.t_junctions_complete = bundle.complete;
  EXPECT_EQ(report.remarks().size(), 1U);
}

}  // namespace
}  // namespace engine
