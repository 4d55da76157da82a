#include "engine/scene/mesh.h"

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/vec.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

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
