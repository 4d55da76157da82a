#include "tools/bench/fine_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/render/far_light.h"
#include "engine/render/traced_target.h"
#include "engine/scene/mesh_spec.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"
#include "tests/support/temp_file.h"

namespace {

using engine::Mesh;

std::vector<double> area_by_material_m2(const Mesh& mesh) {
  std::vector<double> areas(mesh.material_names.size(), 0.0);
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t.corner[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[t.corner[1]].cast<double>() - a;
    const Eigen::Vector3d c = mesh.vertices[t.corner[2]].cast<double>() - a;
    areas[t.material] += 0.5 * b.cross(c).norm();
  }
  return areas;
}

/// Edges that an odd number of triangles share: holes.
std::size_t open_edges(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> shared;
  for (const Mesh::Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++shared[std::minmax(t.corner[i], t.corner[(i + 1) % 3])];
  return static_cast<std::size_t>(
      std::ranges::count_if(shared, [](const auto& edge) { return edge.second % 2 != 0; }));
}

double intensity_w_sr(const Mesh& mesh, const Eigen::Vector3d& from) {
  std::vector<engine::Material> white;
  for (const std::string& name : mesh.material_names)
    white.push_back(test_support::lambert_material(name, 0.5));
  engine::RenderSpec spec;
  spec.bounces = 0;
  spec.samples_per_pixel = 400;
  engine::WorkerPool pool(2);
  engine::FarLight light(spec, std::make_shared<engine::TracedTarget>(mesh, white), pool);
  engine::Snapshot snapshot = test_support::look_at_origin(from * 1e6, {0, 1, 0});
  snapshot.sun = {engine::direction_of<engine::BodyFrame>({0.4, 0.5, -0.7}), 624.0};
  light.update(snapshot, 0.0);
  return light.intensity_w_sr();
}

TEST(FineMesh, SubdividingKeepsTheSurfaceAndClosesWhatWasClosed) {
  const Mesh coarse = engine::telescope_mesh();
  const Mesh merged = bench::subdivided(coarse, 1);
  const Mesh fine = bench::subdivided(coarse, 100'000);
  EXPECT_EQ(merged.triangles.size(), coarse.triangles.size());
  EXPECT_GE(fine.triangles.size(), 100'000U);
  EXPECT_LT(fine.triangles.size(), 105'000U);
  EXPECT_EQ(fine.material_names, coarse.material_names);
  EXPECT_NEAR(fine.bounding_radius_m(), coarse.bounding_radius_m(), 1e-5);
  const std::vector<double> want = area_by_material_m2(coarse);
  const std::vector<double> got = area_by_material_m2(fine);
  for (std::size_t m = 0; m < want.size(); ++m) EXPECT_NEAR(got[m] / want[m], 1.0, 1e-4) << m;
  EXPECT_EQ(open_edges(merged), 0U);
  EXPECT_EQ(open_edges(fine), 0U);
}

TEST(FineMesh, WrinklesAreSeededAndSmallAndChangeNoLight) {
  const Mesh smooth = bench::subdivided(engine::telescope_mesh(), 100'000);
  Mesh wrinkled = smooth;
  bench::wrinkle(wrinkled, 2e-3, 7);
  Mesh again = smooth;
  bench::wrinkle(again, 2e-3, 7);
  Mesh other = smooth;
  bench::wrinkle(other, 2e-3, 8);
  double squares = 0;
  double largest = 0;
  std::size_t same = 0;
  for (std::size_t i = 0; i < smooth.vertices.size(); ++i) {
    ASSERT_EQ(wrinkled.vertices[i], again.vertices[i]);
    same += wrinkled.vertices[i] == other.vertices[i] ? 1U : 0U;
    const double moved = static_cast<double>((wrinkled.vertices[i] - smooth.vertices[i]).norm());
    squares += moved * moved;
    largest = std::max(largest, moved);
  }
  const auto vertices = static_cast<double>(smooth.vertices.size());
  EXPECT_LT(same, smooth.vertices.size() / 100);
  // The variance of n normal numbers is known to sqrt(2 / n), and no number is above 6.
  EXPECT_NEAR(squares / vertices / 4e-6, 1.0, 5.0 * std::sqrt(2.0 / vertices));
  EXPECT_LE(largest, 12.1e-3);
  EXPECT_EQ(open_edges(wrinkled), 0U);
  // Facets of some 6 cm are tilted by .05 rad; to first order tilts cancel.
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0.5, 0.4, -0.77), {-0.2, 0.9, 0.1}})
    EXPECT_NEAR(intensity_w_sr(wrinkled, from) / intensity_w_sr(smooth, from), 1.0, 0.02);
}

TEST(FineMesh, ReadsBackAsItWasWritten) {
  Mesh mesh = bench::subdivided(engine::telescope_mesh(), 20'000);
  bench::wrinkle(mesh, 2e-3, 1);
  const test_support::TempFile file("fine.obj");
  const test_support::TempFile materials("fine.obj.mtl");
  ASSERT_TRUE(bench::write_obj(mesh, file.path()));
  EXPECT_FALSE(bench::write_obj(mesh, "/nowhere/" + file.path()));
  engine::MeshReport report;
  engine::MeshSpec spec;
  spec.name = file.path();
  const Mesh read = engine::load_mesh(spec, report).mesh;
  EXPECT_EQ(report.left_out(), 0U);
  EXPECT_EQ(read.triangles.size(), mesh.triangles.size());
  EXPECT_DOUBLE_EQ(read.bounding_radius_m(), mesh.bounding_radius_m());
  std::vector<std::string> names = read.material_names;
  std::vector<std::string> want = mesh.material_names;
  std::ranges::sort(names);
  std::ranges::sort(want);
  EXPECT_EQ(names, want);
}

}  // namespace
