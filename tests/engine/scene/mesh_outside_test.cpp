#include "engine/scene/mesh_outside.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/scene/mesh_facing.h"
#include "tests/support/obj_text.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test_support::load_obj;

/// Without its lid; on lines 9 to 13, all of them facing in.
constexpr const char* kInwardBox = "f 1 2 3 4\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
constexpr const char* kOutwardBox = "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

MeshOutside::Side side_of(const Mesh& mesh) {
  const MeshTopology topology(mesh);
  EXPECT_EQ(topology.pieces().size(), 1U);
  return MeshOutside(mesh).of(topology.pieces().front());
}

/// A cap of a ball of 1 m about the origin, round -z, as wide as `half_rad` from its middle; faces
/// to the origin.
Mesh dish(double half_rad) {
  constexpr std::uint32_t kRings = 6;
  constexpr std::uint32_t kSpokes = 24;
  Mesh mesh;
  mesh.vertices.emplace_back(0, 0, -1);
  for (std::uint32_t ring = 1; ring <= kRings; ++ring)
    for (std::uint32_t spoke = 0; spoke < kSpokes; ++spoke) {
      const double down = half_rad * ring / kRings;
      const double round = 2 * M_PI * spoke / kSpokes;
      mesh.vertices.push_back(Vector3d(std::sin(down) * std::cos(round),
                                       std::sin(down) * std::sin(round), -std::cos(down))
                                  .cast<float>());
    }
  for (std::uint32_t spoke = 0; spoke < kSpokes; ++spoke) {
    const std::uint32_t next = (spoke + 1) % kSpokes;
    mesh.triangles.push_back({{0, 1 + spoke, 1 + next}, mesh.material("white")});
    for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
      const std::uint32_t in = 1 + ring * kSpokes;
      const std::uint32_t out = in + kSpokes;
      mesh.triangles.push_back({{in + spoke, out + spoke, out + next}, 0});
      mesh.triangles.push_back({{in + spoke, out + next, in + next}, 0});
    }
  }
  return mesh;
}

TEST(MeshOutside, OfABoxWithoutALidIsWhereItsFacesHideNothing) {
  const auto inward = load_obj(std::string(test_support::kCubeCorners) + kInwardBox);
  EXPECT_EQ(inward.report.flipped.lines, (std::vector<std::uint32_t>{9, 10, 11, 12, 13}));
  const auto outward = load_obj(std::string(test_support::kCubeCorners) + kOutwardBox);
  EXPECT_EQ(outward.report.flipped.count, 0U);
  EXPECT_EQ(side_of(outward.mesh()), MeshOutside::Side::kFirst);
  // Four of five face in: the one that does not was right.
  const auto mixed = load_obj(std::string(test_support::kCubeCorners) +
                              "f 4 3 2 1\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n");
  EXPECT_EQ(mixed.report.flipped.lines, (std::vector<std::uint32_t>{10, 11, 12, 13}));
  EXPECT_EQ(mixed.report.not_looked, 0U);
}

TEST(MeshOutside, OfAPlateIsEitherSide) {
  const auto plate = load_obj(std::string(test_support::kUnitSquare) + "f 1 2 3 4\n");
  EXPECT_EQ(side_of(plate.mesh()), MeshOutside::Side::kEither);
  const auto turned = load_obj(std::string(test_support::kUnitSquare) + "f 4 3 2 1\n");
  EXPECT_EQ(turned.report.flipped.count, 0U);
}

TEST(MeshOutside, OfAPlateBeforeABodyIsTheSideAwayFromIt) {
  // Above the cube's lid, as wide.
  const std::string text = std::string(test_support::kCubeCorners) + test_support::kCubeFaces +
                           "v 0 0 1.1\nv 1 0 1.1\nv 1 1 1.1\nv 0 1 1.1\n";
  EXPECT_EQ(load_obj(text + "f 12 11 10 9\n").report.flipped.lines, std::vector<std::uint32_t>{19});
  EXPECT_EQ(load_obj(text + "f 9 10 11 12\n").report.flipped.count, 0U);
}

TEST(MeshOutside, OfADishIsItsBack) {
  for (const double half_deg : {50.0, 90.0, 120.0}) {
    Mesh mesh = dish(half_deg * M_PI / 180);
    EXPECT_EQ(side_of(mesh), MeshOutside::Side::kOther) << half_deg;
    for (Mesh::Triangle& t : mesh.triangles) std::swap(t.corner[1], t.corner[2]);
    EXPECT_EQ(side_of(mesh), MeshOutside::Side::kFirst) << half_deg;
  }
}

TEST(MeshOutside, IsFoundFarFromTheOriginAndForSmallPieces) {
  for (const float scale : {1e-3F, 1.0F, 300.0F}) {
    Mesh mesh = dish(M_PI / 2);
    for (Vector3f& v : mesh.vertices) v = scale * (v + Vector3f(20, -30, 50));
    EXPECT_EQ(side_of(mesh), MeshOutside::Side::kOther) << scale;
  }
}

TEST(MeshOutside, OfAPieceInAClosedHullIsEither) {
  std::string text = std::string(test_support::kCubeCorners) + test_support::kCubeFaces;
  // A box without a lid a quarter as wide, in the middle.
  text +=
      "v .4 .4 .4\nv .6 .4 .4\nv .6 .6 .4\nv .4 .6 .4\nv .4 .4 .6\nv .6 .4 .6\nv .6 .6 .6\n"
      "v .4 .6 .6\n";
  const auto hidden =
      load_obj(text + "f 9 10 11 12\nf 13 14 10 9\nf 14 15 11 10\nf 15 16 12 11\nf 16 13 9 12\n");
  EXPECT_EQ(hidden.report.flipped.count, 0U);
  EXPECT_EQ(hidden.report.pieces, 2U);
}

TEST(MeshOutside, IsGivenUpAfterSoManySteps) {
  // 3000 squares of 1 m across one another: any ray may meet any.
  Mesh mesh;
  for (int i = 0; i < 3000; ++i) {
    const double a = 0.001 * i;
    const Vector3f x = Vector3d(std::cos(a), std::sin(a), 1e-4 * i).cast<float>();
    const Vector3f y = Vector3d(-std::sin(a), 1e-4 * i, std::cos(a)).cast<float>();
    test_support::add_plate(mesh, "white", Vector3f::Constant(1e-4F * static_cast<float>(i)), x, y);
  }
  const Mesh before = mesh;
  const MeshTopology topology(mesh);
  const Facing facing = facing_of(mesh, topology);
  EXPECT_GT(facing.not_looked, 0U);
  EXPECT_LT(facing.not_looked, topology.pieces().size());
  EXPECT_EQ(facing.turn, facing_of(mesh, topology).turn);
  MeshReport report;
  report.not_looked = facing.not_looked;
  EXPECT_EQ(report.remarks().size(), 1U);
}

}  // namespace
}  // namespace engine
