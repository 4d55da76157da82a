#include "engine/scene/telescope.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <gtest/gtest.h>

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3d corner(const Mesh& mesh, const Mesh::Triangle& t, std::size_t i) {
  return mesh.vertices[t.corner[i]].cast<double>();
}
Vector3d area_vector(const Mesh& mesh, const Mesh::Triangle& t) {
  return 0.5 *
         (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
}

TEST(TelescopeMesh, IsClosed) {
  // Every edge is walked as often one way as the other; corners in one place are one corner.
  const Mesh mesh = telescope_mesh();
  std::map<std::array<float, 3>, int> places;
  const auto place = [&](std::uint32_t v) {
    const Vector3f& p = mesh.vertices[v];
    return places
        .emplace(std::array<float, 3>{p.x() + 0.0F, p.y() + 0.0F, p.z() + 0.0F},
                 static_cast<int>(places.size()))
        .first->second;
  };
  std::map<std::pair<int, int>, int> walked;
  for (const Mesh::Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = place(t.corner[i]);
      const int b = place(t.corner[(i + 1) % 3]);
      ASSERT_NE(a, b);
      if (a < b) {
        ++walked[{a, b}];
      } else {
        --walked[{b, a}];
      }
    }
  }
  const auto open =
      std::count_if(walked.begin(), walked.end(), [](const auto& e) { return e.second != 0; });
  EXPECT_EQ(open, 0) << "of " << walked.size() << " edges";
}

TEST(TelescopeMesh, HasOutsideOutside) {
  // By Gauss: the volume of every part is positive only with its normals outwards.
  const Mesh mesh = telescope_mesh();
  double volume_m3 = 0;
  Vector3d all_areas = Vector3d::Zero();
  for (const Mesh::Triangle& t : mesh.triangles) {
    volume_m3 += corner(mesh, t, 0).dot(area_vector(mesh, t)) / 3.0;
    all_areas += area_vector(mesh, t);
  }
  EXPECT_GT(volume_m3, 50.0);
  EXPECT_LT(all_areas.norm(), 1e-3);  // closed: single precision of 400 m^2
}

TEST(TelescopeMesh, HasNoFaceWithoutAreaAndFewFaces) {
  const Mesh mesh = telescope_mesh();
  EXPECT_GT(mesh.triangles.size(), 1000U);
  EXPECT_LT(mesh.triangles.size(), 15000U);
  for (const Mesh::Triangle& t : mesh.triangles) {
    ASSERT_GT(area_vector(mesh, t).norm(), 0.0);
    ASSERT_LT(t.material, mesh.material_names.size());
  }
}

TEST(TelescopeMesh, HasThePublishedDimensions) {
  const Mesh mesh = telescope_mesh();
  float aft = 0.0F;
  float wing_low = 0.0F;
  float wing_high = 0.0F;
  float widest = 0.0F;
  for (const Vector3f& v : mesh.vertices) {
    // Latches and plugs stand out behind the tube, nothing as wide as it.
    if (std::hypot(v.y(), v.z()) > 1.9F) aft = std::min(aft, v.x());
    wing_low = std::min(wing_low, v.y());
    wing_high = std::max(wing_high, v.y());
    if (v.x() < -3.2F) widest = std::max(widest, std::hypot(v.y(), v.z()));
  }
  // Its facets have their corners on the circle: exact but for single precision.
  EXPECT_NEAR(aft, -6.6F, 1e-5F);
  EXPECT_NEAR(wing_high - wing_low, 13.7F, 1e-5F);
  EXPECT_NEAR(2.0F * widest, 4.2F, 1e-5F);
  const bool rim = std::any_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Vector3f& v) {
    return std::abs(v.x() - 6.6F) < 1e-5F && std::hypot(v.y(), v.z()) > 1.4F;
  });
  EXPECT_TRUE(rim) << "the tube ends 13.2 m from its aft end";
}

TEST(TelescopeMesh, HasItsCellsOnTheSideAwayFromTheNadir) {
  const Mesh mesh = telescope_mesh();
  const auto named = [&](const char* name) {
    return static_cast<std::uint32_t>(
        std::find(mesh.material_names.begin(), mesh.material_names.end(), name) -
        mesh.material_names.begin());
  };
  ASSERT_EQ(mesh.material_names.size(), 3U);
  ASSERT_LT(named("silicon"), 3U);
  ASSERT_LT(named("polyimide"), 3U);
  ASSERT_LT(named("black"), 3U);
  double cells_m2 = 0;
  for (const Mesh::Triangle& t : mesh.triangles) {
    if (t.material != named("silicon")) continue;
    // Each module is a slab let into the panel: its outer face looks to the Sun's side.
    const Vector3d area = area_vector(mesh, t);
    if (area.normalized().z() < -0.999) cells_m2 += area.norm();
    ASSERT_LT(corner(mesh, t, 0).z(), 0.02) << "behind the panel";
  }
  // Two wings of 7.1 m by 2.6 m; frames, gaps and the mast take up to a fifth.
  EXPECT_GT(cells_m2, 0.8 * 2.0 * 7.1 * 2.6);
  EXPECT_LT(cells_m2, 2.0 * 7.1 * 2.6);
}

}  // namespace
}  // namespace engine
