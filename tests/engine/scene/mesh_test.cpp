#include "engine/scene/mesh.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

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

TEST(SmoothNormals, AreTheMeanWithinTheCreaseAtAPlaceOfThousandsOfFaces) {
  // A cone of 45 deg, every third face backwards, and a flat one of needles on its tip.
  constexpr std::uint32_t kFaces = 3000;
  Mesh mesh;
  mesh.vertices.emplace_back(Eigen::Vector3f::Zero());
  for (std::uint32_t i = 0; i < 2 * kFaces; ++i) {
    const double a = 2.0 * M_PI * i / kFaces;
    mesh.vertices.emplace_back(
        Eigen::Vector3d(std::cos(a), std::sin(a), i < kFaces ? -1 : 0).cast<float>());
    const std::uint32_t next = i % kFaces + 1 < kFaces ? i + 2 : i + 2 - kFaces;
    mesh.triangles.push_back(
        {i % 3 == 0 ? std::array{0U, next, i + 1} : std::array{0U, i + 1, next},
         mesh.material("white")});
  }
  const auto normal_of = [&](std::size_t t) {
    const auto& [a, b, c] = mesh.triangles[t].corner;
    return mesh.vertices[b].cross(mesh.vertices[c]).cast<double>().normalized().eval();
  };
  for (const double crease_deg : {10.0, 50.0, 120.0}) {
    const std::vector<CornerNormals> normals = smooth_normals(mesh, crease_deg * kDegree);
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 97) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
        const double cosine = normal_of(k).dot(normal_of(i));
        // All angles of one cone's tip are alike: on a slope they are shorter by its cosine.
        const double angle = k < kFaces ? std::sqrt(0.5) : 1.0;
        if (std::abs(cosine) >= std::cos(crease_deg * kDegree))
          sum += std::copysign(angle, cosine) * normal_of(k);
      }
      // A face at the crease may be in or out: one of 160, 10 deg off, is 1e-3.
      EXPECT_LT(angle_between_rad(normals[i][0].cast<double>(), sum), 2e-3) << i << crease_deg;
    }
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
