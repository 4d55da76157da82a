#include "engine/scene/mesh_repair.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/scene/telescope.h"
#include "engine/scene/vertex_places.h"
#include "tests/support/obj_text.h"
#include "tests/support/path_tracing.h"

namespace engine {
namespace {

using Eigen::Vector3f;
using test_support::kCubeCorners;
using test_support::kCubeFaces;
using test_support::load_obj;
using test_support::LoadedObj;

const std::string kCube = std::string(kCubeCorners) + kCubeFaces;
constexpr int kSide_px = 32;

std::vector<float> image_of(const Mesh& mesh) {
  Mesh large = mesh;  // some 20 pixels
  for (Vector3f& v : large.vertices) v = 3.0F * (v - Vector3f::Constant(0.5F));
  std::vector<Material> materials;
  for (const std::string& name : mesh.material_names)
    materials.push_back(test_support::lambert_material(name, 0.5));
  const Snapshot snapshot = [] {
    Snapshot s = test_support::look_at_origin({60e3, 40e3, 69e3}, test_support::kUp);
    s.sun = {test_support::toward({0.3, 0.2, 0.9}), test_support::kSun_w_m2};
    return s;
  }();
  const auto rendered =
      test_support::render(test_support::spec_of(kSide_px), large, materials, snapshot);
  EXPECT_GT(rendered.sum(), 0.0);
  const auto pixels = rendered.light.grid.pixels();
  return {pixels.begin(), pixels.end()};
}

TEST(MeshRepair, LeavesACleanCubeAsItIs) {
  const LoadedObj cube = load_obj(kCube);
  EXPECT_TRUE(cube.report.clean());
  EXPECT_TRUE(cube.report.repairs().empty());
  EXPECT_TRUE(cube.report.remarks().empty());
  EXPECT_EQ(cube.report.pieces, 1U);
  EXPECT_EQ(cube.report.closed_pieces, 1U);
  EXPECT_EQ(cube.report.edges, 18U);
  EXPECT_EQ(cube.report.euler_characteristic, 2);
  EXPECT_DOUBLE_EQ(cube.report.area_m2, 6.0);
  EXPECT_DOUBLE_EQ(cube.report.volume_m3, 1.0);
  EXPECT_EQ(cube.report.low_m, Eigen::Vector3d::Zero());
  EXPECT_EQ(cube.report.high_m, Eigen::Vector3d::Ones());
}

TEST(MeshRepair, TurnsThreeFlippedFacesOfACubeRound) {
  const LoadedObj flipped =
      load_obj(std::string(kCubeCorners) +
               "f 4 3 2 1\nf 8 7 6 5\nf 1 2 6 5\nf 6 7 3 2\nf 3 4 8 7\nf 8 5 1 4\n");
  EXPECT_EQ(flipped.report.flipped.count, 3U);
  EXPECT_EQ(flipped.report.flipped.lines, (std::vector<std::uint32_t>{10, 12, 14}));
  EXPECT_DOUBLE_EQ(flipped.report.volume_m3, 1.0);
  EXPECT_EQ(image_of(flipped.mesh()), image_of(load_obj(kCube).mesh()));
  // Three of six may be the ones that are right: outwards decides, not the first or the most.
  const LoadedObj others =
      load_obj(std::string(kCubeCorners) +
               "f 1 2 3 4\nf 5 6 7 8\nf 5 6 2 1\nf 2 3 7 6\nf 7 8 4 3\nf 5 8 4 1\n");
  EXPECT_EQ(others.report.flipped.lines, (std::vector<std::uint32_t>{9, 11, 13}));
  EXPECT_DOUBLE_EQ(others.report.volume_m3, 1.0);
}

TEST(MeshRepair, TurnsABodyThatIsInsideOut) {
  const LoadedObj cube = load_obj(std::string(kCubeCorners) +
                                  "f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 "
                                  "4\n");
  EXPECT_EQ(cube.report.flipped.count, 6U);
  EXPECT_DOUBLE_EQ(cube.report.volume_m3, 1.0);
}

/// Within the cube, half as wide.
std::string small_corners() {
  std::string text;
  for (const char* v : {"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"}) {
    text += "v";
    for (int i = 0; i < 3; ++i) text += v[2 * i] == '0' ? " .25" : " .75";
    text += "\n";
  }
  return text;
}
/// Inwards, of the last eight corners.
constexpr const char* kInwardFaces =
    "f -8 -7 -6 -5\nf -1 -2 -3 -4\nf -4 -3 -7 -8\nf -3 -2 -6 -7\nf -2 -1 -5 -6\nf -1 -4 -8 -5\n";

TEST(MeshRepair, TakesNothingForACavityInABodyThatIsInsideOut) {
  const LoadedObj two =
      load_obj(std::string(kCubeCorners) + kInwardFaces + small_corners() + kInwardFaces);
  EXPECT_EQ(two.report.flipped.count, 12U);
  EXPECT_DOUBLE_EQ(two.report.volume_m3, 1.0 + 0.125);
}

TEST(MeshRepair, KeepsTheWallOfACavityWhenAFaceOfTheHullIsFlipped) {
  const LoadedObj hollow =
      load_obj(std::string(kCubeCorners) +
               "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n" +
               small_corners() + kInwardFaces);
  EXPECT_EQ(hollow.report.flipped.count, 1U);
  EXPECT_DOUBLE_EQ(hollow.report.volume_m3, 1.0 - 0.125);
}

TEST(MeshRepair, KeepsTheWallOfACavity) {
  const LoadedObj hollow = load_obj(kCube + small_corners() + kInwardFaces);
  EXPECT_EQ(hollow.report.flipped.count, 0U);
  EXPECT_EQ(hollow.report.pieces, 2U);
  EXPECT_DOUBLE_EQ(hollow.report.volume_m3, 1.0 - 0.125);
}

TEST(MeshRepair, MakesAnOpenSheetFaceAsMostOfItDoes) {
  const LoadedObj sheet = load_obj(
      "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 3 1 0\n"
      "f 1 5 6 2\nf 2 3 7 6\nf 3 4 8 7\n");
  EXPECT_EQ(sheet.report.flipped.count, 1U);
  EXPECT_EQ(sheet.report.flipped.lines, std::vector<std::uint32_t>{9});
  EXPECT_EQ(sheet.report.open_edges.count, 8U);
  EXPECT_EQ(sheet.report.closed_pieces, 0U);
}

TEST(MeshRepair, LeavesASheetWithOneSide) {
  std::string text;
  const int steps = 24;
  for (int i = 0; i < steps; ++i) {
    const double a = 2.0 * M_PI * i / steps;
    for (const double across : {-0.3, 0.3}) {
      const double r = 1.0 + across * std::cos(0.5 * a);
      text += "v " + std::to_string(r * std::cos(a)) + " " + std::to_string(r * std::sin(a)) + " " +
              std::to_string(across * std::sin(0.5 * a)) + "\n";
    }
  }
  const auto f = [&](int a, int b, int c, int d) {
    for (const int i : {a, b, c, d})
      text += (i == a ? "f " : " ") + std::to_string(i) + (i == d ? "\n" : "");
  };
  for (int i = 0; i + 1 < steps; ++i) f(2 * i + 1, 2 * i + 2, 2 * i + 4, 2 * i + 3);
  f(2 * steps - 1, 2 * steps, 1, 2);
  const LoadedObj strip = load_obj(text);
  EXPECT_EQ(strip.report.one_sided, 1U);
  EXPECT_EQ(strip.report.flipped.count, 0U);
  EXPECT_EQ(strip.report.euler_characteristic, 0);
}

TEST(MeshRepair, ShowsTheSameImageWhenEveryFaceIsThereTwice) {
  const LoadedObj twice = load_obj(kCube + kCubeFaces);
  EXPECT_EQ(twice.report.duplicate.count, 6U);
  EXPECT_EQ(twice.report.duplicate.lines, (std::vector<std::uint32_t>{15, 16, 17, 18, 19}));
  EXPECT_TRUE(twice.report.open_edges.count == 0 && twice.report.non_manifold_edges.count == 0);
  EXPECT_EQ(image_of(twice.mesh()), image_of(load_obj(kCube).mesh()));
  // With corners of its own, other side up, from another corner on, in another material.
  const LoadedObj sheets = load_obj(kCube + "usemtl white\n" + kCubeCorners + "f 10 11 12 9\n");
  EXPECT_EQ(sheets.report.duplicate.count, 1U);
  EXPECT_EQ(sheets.report.duplicate_of_other_material, 1U);
  EXPECT_EQ(sheets.mesh().material_names, std::vector<std::string>{"default"});
}

TEST(MeshRepair, RendersTheGoodFaceAmongBadOnes) {
  const std::string square = test_support::kUnitSquare;
  const LoadedObj good = load_obj(square + "f 1 2 3 4\n");
  const LoadedObj bad = load_obj(
      square +
      "v nan 0 5\nv 1e30 0 0\nv 0 1e39 0\nv 0 -inf 1\nv 1.#QNAN 0 0\nf 1 2 3 4\nf 1 2 3 4\n"
      "f 1 1 2\nf 1 2 1 2\nf 1 2 5\nf 1 2 6\nf 1 2 7\nf 1 2 8\nf 1 2 9\n");
  EXPECT_EQ(bad.report.not_finite.count, 5U);
  EXPECT_EQ(bad.report.not_finite.lines, (std::vector<std::uint32_t>{14, 15, 16, 17, 18}));
  EXPECT_EQ(bad.report.zero_area.count, 2U);
  EXPECT_EQ(bad.report.duplicate.count, 1U);
  EXPECT_EQ(bad.report.left_out(), 8U);
  EXPECT_EQ(bad.mesh().vertices.size(), 4U);
  EXPECT_EQ(image_of(bad.mesh()), image_of(good.mesh()));
}

TEST(MeshRepair, LeavesAFaceWithABadCornerOutAsAWhole) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv nan 1 0\nv .5 1e7 0\nv .5 2 0\n";
  for (const char* face : {"f 1 2 3 4\n", "f 3 4 1 2\n", "f 1 2 3 5\n", "f 1 2 3 6 4\n"}) {
    const LoadedObj bad = load_obj(corners + face);
    EXPECT_TRUE(bad.mesh().triangles.empty()) << face;
    EXPECT_EQ(bad.report.not_finite.count, 1U) << face;
    EXPECT_EQ(bad.report.tangled.count, 0U) << face;
  }
  // Its neighbour stays.
  EXPECT_EQ(load_obj(corners + "f 1 2 3 4\nf 1 2 3 6\n").mesh().triangles.size(), 2U);
}

TEST(MeshRepair, CountsAFaceOnceHoweverItLosesItsTriangles) {
  // Of a ribbon one triangle goes as its corners are welded, the other for its height.
  const LoadedObj ribbon =
      load_obj(kCube + "v .3 6e-7 0\nv .3 0 0\nv .9 3e-7 0\nv .6 8e-7 0\nf 9 10 11 12\n");
  EXPECT_EQ(ribbon.report.zero_area.count, 1U);
  EXPECT_EQ(ribbon.mesh().triangles.size(), 12U);
}

TEST(MeshRepair, CallsCleanACubeWhoseFacesHaveCornersOfTheirOwn) {
  std::string text;
  for (const char* face : {"f -5 -6 -7 -8", "f -4 -3 -2 -1", "f -8 -7 -3 -4", "f -7 -6 -2 -3",
                           "f -6 -5 -1 -2", "f -5 -8 -4 -1"})
    text += std::string(kCubeCorners) + face + "\n";
  const LoadedObj split = load_obj(text);
  EXPECT_EQ(split.report.welded, 40U);
  EXPECT_TRUE(split.report.clean());
}

TEST(MeshRepair, MayComeOutEmpty) {
  const LoadedObj loaded = load_obj(std::string(test_support::kUnitSquare) + "f 1 1 1\n");
  EXPECT_TRUE(loaded.mesh().triangles.empty());
  EXPECT_TRUE(loaded.mesh().vertices.empty());
}

TEST(MeshRepair, WeldsWhatSixDigitsTookApart) {
  // Every face with corners of its own, each off by less than the sixth digit.
  std::minstd_rand chance(1);
  std::uniform_real_distribution<double> off(-2e-7, 2e-7);
  GroupedMesh cube = load_obj(kCube).grouped;
  GroupedMesh loose;
  loose.mesh.material_names = cube.mesh.material_names;
  loose.group_names = cube.group_names;
  for (const Mesh::Triangle& t : cube.mesh.triangles) {
    Mesh::Triangle own{{}, t.material};
    for (std::size_t k = 0; k < 3; ++k) {
      own.corner[k] = static_cast<std::uint32_t>(loose.mesh.vertices.size());
      const Eigen::Vector3d shifted = cube.mesh.vertices[t.corner[k]].cast<double>() +
                                      Eigen::Vector3d(off(chance), off(chance), off(chance));
      loose.mesh.vertices.emplace_back(shifted.cast<float>());
    }
    loose.mesh.triangles.push_back(own);
  }
  // Size is the median of distances from a corner: that of a face's diagonal.
  MeshReport report;
  repair(loose, {}, report);
  EXPECT_EQ(report.welded, 28U);
  EXPECT_NEAR(report.weld_m, std::sqrt(2.0) * 1e-6, 1e-12);
  EXPECT_EQ(report.closed_pieces, 1U);
  EXPECT_EQ(report.euler_characteristic, 2);
  EXPECT_NEAR(report.volume_m3, 1.0, 3 * 2e-7);
  EXPECT_TRUE(report.open_edges.lines.empty());
}

TEST(MeshRepair, IsNotMisledByAStrayCornerFarOut) {
  // By the largest extent the weld were 1 m, and all of the cube one vertex.
  const LoadedObj loaded = load_obj(kCube + "v 9e5 9e5 0\nf 1 2 9\n");
  EXPECT_EQ(loaded.report.welded, 0U);
  EXPECT_EQ(loaded.mesh().triangles.size(), 13U);
}

TEST(MeshRepair, CountsEdgesOfOneFaceAndOfMany) {
  // A cube without its lid, and a fin on one of its edges.
  const LoadedObj open = load_obj(std::string(kCubeCorners) +
                                  "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
                                  "v -1 -1 0\nf 1 2 9\n");
  EXPECT_EQ(open.report.open_edges.count, 4U + 2U);
  EXPECT_EQ(open.report.non_manifold_edges.count, 1U);
  EXPECT_EQ(open.report.edge_places.size(), 7U);
  EXPECT_EQ(open.report.closed_pieces, 0U);
  EXPECT_FALSE(open.report.clean());
}

TEST(MeshRepair, LeavesOutWhatIsLowerThanTheWeldAndTellsSlivers) {
  const LoadedObj flat = load_obj(std::string(test_support::kUnitSquare) +
                                  "v .5 1e-7 0\nv .5 -1e-4 0\nf 1 2 3 4\nf 1 2 5\nf 1 6 2\n");
  EXPECT_EQ(flat.report.zero_area.lines, std::vector<std::uint32_t>{8});
  EXPECT_EQ(flat.report.slivers.lines, std::vector<std::uint32_t>{9});
  EXPECT_EQ(flat.mesh().triangles.size(), 3U);
}

TEST(MeshRepair, CountsEdgesWithAFlatFaceThatClosesAGap) {
  // A corner in the middle of an edge: the face of no height joins both sides of it.
  const LoadedObj bridged = load_obj(std::string(kCubeCorners) +
                                     "v .5 0 0\nf 4 3 2 1\nf 5 6 7 8\nf 1 9 2 6 5\nf 1 2 9\n"
                                     "f 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  EXPECT_EQ(bridged.report.open_edges.count, 0U);
  EXPECT_EQ(bridged.report.closed_pieces, 1U);
  EXPECT_EQ(bridged.report.zero_area.count, 1U);
  EXPECT_DOUBLE_EQ(bridged.report.volume_m3, 1.0);
}

TEST(MeshRepair, FindsNothingWrongWithTheBuiltInTelescope) {
  GroupedMesh grouped;
  grouped.mesh = telescope_mesh();
  const Mesh before = grouped.mesh;
  MeshReport report;
  repair(grouped, {}, report);
  EXPECT_EQ(report.left_out(), 0U);
  EXPECT_EQ(report.flipped.count, 0U);
  EXPECT_EQ(report.open_edges.count + report.non_manifold_edges.count, 0U);
  EXPECT_EQ(report.closed_pieces, report.pieces);
  ASSERT_EQ(grouped.mesh.triangles.size(), before.triangles.size());
}

TEST(VertexPlaces, AreWhatComparingAllPairsFinds) {
  std::minstd_rand chance(7);
  std::uniform_real_distribution<float> where(-1.0F, 1.0F);
  std::vector<Vector3f> vertices;
  for (int i = 0; i < 600; ++i) vertices.emplace_back(where(chance), where(chance), where(chance));
  vertices.emplace_back(Vector3f::Constant(std::nanf("")));
  vertices.emplace_back(-0.0F, 0.0F, 0.0F);
  vertices.emplace_back(0.0F, -0.0F, 0.0F);
  for (const double weld_m : {0.0, 0.02, 0.1, 0.5}) {
    const std::vector<std::uint32_t> got = first_at_place(vertices, weld_m);
    std::size_t welded = 0;
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
      std::uint32_t want = i;
      for (std::uint32_t k = 0; k < i && want == i; ++k)
        if (got[k] == k &&
            (vertices[i].cast<double>() - vertices[k].cast<double>()).norm() <= weld_m)
          want = k;
      ASSERT_EQ(got[i], want) << i << " within " << weld_m;
      welded += want != i ? 1 : 0;
    }
    EXPECT_GE(welded, 1U) << weld_m;
  }
}

}  // namespace
}  // namespace engine
