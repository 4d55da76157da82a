#include "engine/scene/mesh.h"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/core/vec.h"
#include "tests/support/scenes.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using test_support::TempFile;

struct Loaded {
  Mesh mesh;
  MeshReport report;
};
Loaded load(std::string_view text) {
  const TempFile file("mesh.obj", text);
  Loaded loaded;
  loaded.mesh = load_obj(file.path(), loaded.report);
  return loaded;
}

double area_m2(const Mesh& mesh) {
  double sum = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    const auto& a = mesh.vertices[t.corner[0]];
    const auto& b = mesh.vertices[t.corner[1]];
    const auto& c = mesh.vertices[t.corner[2]];
    sum += 0.5 * static_cast<double>((b - a).cross(c - a).norm());
  }
  return sum;
}

constexpr const char* kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(LoadObj, CutsAQuadIntoTwoTriangles) {
  const Loaded loaded = load(std::string(kSquare) + "f 1 2 3 4\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
  EXPECT_DOUBLE_EQ(area_m2(loaded.mesh), 1.0);
  EXPECT_EQ(loaded.report.left_out(), 0U);
}

TEST(LoadObj, CutsAPolygon) {
  const Loaded loaded = load("v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 3U);
  EXPECT_DOUBLE_EQ(area_m2(loaded.mesh), 5.0);
}

TEST(LoadObj, CountsNegativeIndicesFromTheEnd) {
  const Loaded loaded = load(std::string(kSquare) + "f -4 -3 -2 -1\n");
  EXPECT_DOUBLE_EQ(area_m2(loaded.mesh), 1.0);
}

TEST(LoadObj, TakesNormalsAndTextureOrNeither) {
  const std::string with = std::string(kSquare) + "vn 0 0 1\nvt 0 0\n";
  EXPECT_DOUBLE_EQ(area_m2(load(with + "f 1/1/1 2/1/1 3/1/1 4/1/1\n").mesh), 1.0);
  EXPECT_DOUBLE_EQ(area_m2(load(with + "f 1//1 2//1 3//1 4//1\n").mesh), 1.0);
  EXPECT_DOUBLE_EQ(area_m2(load(with + "f 1/1 2/1 3/1 4/1\n").mesh), 1.0);
}

TEST(LoadObj, TakesCarriageReturnsAndAMissingLastNewline) {
  const Loaded loaded = load("v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4");
  EXPECT_DOUBLE_EQ(area_m2(loaded.mesh), 1.0);
}

TEST(LoadObj, KeepsTheOrderOfCornersAndTheSizeInMetres) {
  const Loaded loaded = load("v 0 0 0\nv 0.25 0 0\nv 0 0 -2.5\nf 1 2 3\n");
  ASSERT_EQ(loaded.mesh.triangles.size(), 1U);
  const auto& t = loaded.mesh.triangles[0];
  EXPECT_EQ(loaded.mesh.vertices[t.corner[1]], Eigen::Vector3f(0.25F, 0.0F, 0.0F));
  EXPECT_EQ(loaded.mesh.vertices[t.corner[2]], Eigen::Vector3f(0.0F, 0.0F, -2.5F));
  EXPECT_DOUBLE_EQ(loaded.mesh.bounding_radius_m(), 2.5);
}

TEST(LoadObj, LeavesOutFacesWithoutANumberOrWithoutArea) {
  const Loaded loaded =
      load(std::string(kSquare) +
           "v 1e30 0 0\nv 0 1e39 0\nf 1 2 3 4\nf 1 2 5\nf 1 2 6\nf 1 1 2\nf 1 2 2\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
  EXPECT_EQ(loaded.report.not_finite, 2U);
  EXPECT_EQ(loaded.report.zero_area, 2U);
  EXPECT_EQ(loaded.report.left_out(), 4U);
  EXPECT_NEAR(loaded.mesh.bounding_radius_m(), std::sqrt(2.0), 1e-7);
}

TEST(LoadObj, LeavesOutAFaceWhoseCornerIsNotANumber) {
  const Loaded loaded =
      load(std::string(kSquare) + "v nan 0 5\nv 0 inf 5\nf 1 2 3 4\nf 1 2 5\nf 1 3 6\n");
  EXPECT_EQ(loaded.mesh.triangles.size(), 2U);
  EXPECT_EQ(loaded.report.not_finite, 2U);
}

TEST(LoadObj, KeepsDuplicateFaces) {
  EXPECT_EQ(load(std::string(kSquare) + "f 1 2 3\nf 1 2 3\n").mesh.triangles.size(), 2U);
}

TEST(LoadObj, RefusesIndicesOutsideTheFile) {
  for (const char* face :
       {"f 1 2 9\n", "f 1 2 2147483647\n", "f 1 2 -9\n", "f 0 1 2\n", "f 1 2 3 9\n",
        "f 1 2 3 4 9\n", "f 9 9 9 9 9\n", "f 1 2 99999999999999\n"})
    EXPECT_THROW(load(std::string(kSquare) + face), ConfigError) << face;
}

TEST(LoadObj, RefusesWhatHoldsNoFace) {
  EXPECT_THROW(load(""), ConfigError);
  EXPECT_THROW(load("\n\n# nothing\n"), ConfigError);
  EXPECT_THROW(load(kSquare), ConfigError);
  EXPECT_THROW(load("f 1 2 3\n"), ConfigError);
  EXPECT_THROW(load(std::string(kSquare) + "f 1 1 1\n"), ConfigError);
  EXPECT_THROW(load(std::string(kSquare) + "l 1 2\np 1\nl 1\n"), ConfigError);
  EXPECT_THROW(load(std::string("\0\1\2\xff\xfe binary \0 f v", 18)), ConfigError);
}

TEST(LoadObj, SurvivesOddLines) {
  // A 33-digit number, a line of one vertex, a face of two corners, a word out of place.
  const Loaded loaded = load(std::string(kSquare) +
                             "v 0.000000000000000000000000000000001 0 0\nl 1\nf 1 2\nxyzzy 1\n"
                             "g\no\ns off\nf 1 2 3 4\n");
  EXPECT_DOUBLE_EQ(area_m2(loaded.mesh), 1.0);
}

TEST(LoadObj, NamesTheFileThatIsNotThere) {
  MeshReport report;
  try {
    static_cast<void>(load_obj("/nowhere/at_all.obj", report));
    FAIL() << "a file that is not there was read";
  } catch (const ConfigError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("/nowhere/at_all.obj: ")) << e.what();
  }
}

TEST(LoadObj, TakesMaterialNamesFromTheLibrary) {
  const TempFile library("mesh.mtl", "newmtl gold\nnewmtl glass\n");
  const std::string name = library.path().substr(library.path().rfind('/') + 1);
  const Loaded loaded =
      load("mtllib " + name + "\n" + kSquare + "usemtl glass\nf 1 2 3\nusemtl gold\nf 1 3 4\n");
  ASSERT_EQ(loaded.mesh.triangles.size(), 2U);
  EXPECT_EQ(loaded.mesh.material_names[loaded.mesh.triangles[0].material], "glass");
  EXPECT_EQ(loaded.mesh.material_names[loaded.mesh.triangles[1].material], "gold");
}

TEST(LoadObj, CallsFacesWithoutAMaterialDefault) {
  const Loaded loaded = load(std::string(kSquare) + "f 1 2 3\n");
  ASSERT_EQ(loaded.mesh.material_names.size(), 1U);
  EXPECT_EQ(loaded.mesh.material_names[0], "default");
}

TEST(SmoothNormals, AreThoseOfTheBallItStandsFor) {
  const Mesh mesh = test_support::sphere(2.0F, 40, 80, "white");
  const std::vector<CornerNormals> normals = smooth_normals(mesh, 40.0 * kDegree);
  ASSERT_EQ(normals.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d ball =
          mesh.vertices[mesh.triangles[i].corner[c]].cast<double>().normalized();
      // Facets of 4.5 deg: their mean is off by the asymmetry of six of them, a quarter of that.
      ASSERT_LT(angle_between_rad(normals[i][c].cast<double>(), ball), 1.2 * kDegree) << i;
    }
  }
}

TEST(SmoothNormals, KeepAnEdge) {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  test_support::add_plate(mesh, "white", {0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const std::vector<CornerNormals> normals = smooth_normals(mesh, 40.0 * kDegree);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Eigen::Vector3f flat = i < 2 ? Eigen::Vector3f(0, 0, 1) : Eigen::Vector3f(1, 0, 0);
    for (const Eigen::Vector3f& n : normals[i]) EXPECT_LT((n - flat).norm(), 1e-6F) << i;
  }
}

TEST(Mesh, NamesEachMaterialOnce) {
  Mesh mesh;
  EXPECT_EQ(mesh.material("a"), 0U);
  EXPECT_EQ(mesh.material("b"), 1U);
  EXPECT_EQ(mesh.material("a"), 0U);
  EXPECT_EQ(mesh.material_names.size(), 2U);
}

}  // namespace
}  // namespace engine
