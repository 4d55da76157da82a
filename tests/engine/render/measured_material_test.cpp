// Surfaces that are a measured table, drawn by each renderer.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/mesh_levels.h"
#include "tests/support/goniometer.h"
#include "tests/support/path_tracing.h"
#include "tests/support/surfaces.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::kSun_w_m2;
using test_support::scanned;
using test_support::spec_of;
using test_support::sum_of;

template <class F>
Material measured(const std::string& name, const F& f) {
  Material material;
  material.name = name;
  material.table = std::make_shared<BrdfGrid>(scanned({5, 20, 35, 50, 65, 80}, f));
  return material;
}

Radiance drawn_by(RenderMethod method, RenderSpec spec, const Mesh& mesh,
                  const std::vector<Material>& materials, const Snapshot& snapshot) {
  spec.method = method;
  spec.settled = true;
  spec.far_target = FarTargetForm::kResolved;
  WorkerPool pool(1);
  const auto renderer = make_renderer(spec, std::make_shared<TracedTarget>(mesh, materials), pool);
  Radiance out;
  static_cast<void>(renderer->render(snapshot, {}, out));
  return out;
}

/// A floor and a wall on it: light that bounces.
Mesh corner() {
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-3, -3, 0}, {6, 0, 0}, {0, 6, 0});
  test_support::add_plate(mesh, "white", {3, -3, 0}, {0, 0, 4}, {0, 6, 0});
  return mesh;
}

TEST(MeasuredMaterial, LambertTableIsDrawnAsLambertsLaw) {
  const Material table = measured("white", [](const auto&, const auto&) { return 0.3 / kPi; });
  const Material lambert = test_support::lambert_material("white", 0.3);
  for (const RenderMethod method : {RenderMethod::kPaths, RenderMethod::kLattice}) {
    const RenderSpec spec = spec_of(48, 1);
    const Radiance a = drawn_by(method, spec, corner(), {table}, test_support::above(40.0));
    const Radiance b = drawn_by(method, spec, corner(), {lambert}, test_support::above(40.0));
    ASSERT_EQ(a.grid.pixels().size(), b.grid.pixels().size());
    double brightest = 0;
    double furthest = 0;
    for (std::size_t i = 0; i < a.grid.pixels().size(); ++i) {
      brightest = std::max(brightest, static_cast<double>(b.grid.pixels()[i]));
      furthest = std::max(furthest, std::abs(static_cast<double>(a.grid.pixels()[i]) -
                                             static_cast<double>(b.grid.pixels()[i])));
    }
    EXPECT_GT(brightest, 0.3 * kSun_w_m2 / kPi * std::cos(40 * kDegree));
    // Albedos of the table are integrated to 1e-3, and decide how often lamps are asked.
    EXPECT_LT(furthest, 2e-3 * brightest) << static_cast<int>(method);
  }
}

TEST(MeasuredMaterial, GlossyTableIsDrawnAsWhatWasMeasured) {
  const Brdf& polyimide = test_support::brdf_of("polyimide", Brdf::Variant::kPhysical);
  const Material table =
      measured("white", [&](const auto& in, const auto& out) { return polyimide.eval(in, out); });
  const Material parameters{"white", test_support::polyimide()};
  for (const RenderMethod method : {RenderMethod::kPaths, RenderMethod::kLattice}) {
    const Snapshot snapshot = test_support::above(42.0);
    const double a =
        sum_of(drawn_by(method, spec_of(16), test_support::plate(1.0F), {table}, snapshot));
    const double b =
        sum_of(drawn_by(method, spec_of(16), test_support::plate(1.0F), {parameters}, snapshot));
    // Between incidences 15 deg apart and steps of 5 deg off the mirror.
    EXPECT_NEAR(a / b, 1.0, 0.05) << static_cast<int>(method);
  }
}

TEST(MeasuredMaterial, FineMeshWithATableKeepsItsOwnMesh) {
  RenderSpec spec = spec_of(32);
  spec.noise = {1e4, 25.0, 30000.0};
  // A bowl of more triangles than a mesh has that is drawn as it is.
  Mesh mesh;
  const std::uint32_t white = mesh.material("white");
  constexpr std::uint32_t kSide = 110;
  for (std::uint32_t i = 0; i <= kSide; ++i)
    for (std::uint32_t k = 0; k <= kSide; ++k) {
      const auto x = 4.0F * static_cast<float>(i) / kSide - 2.0F;
      const auto y = 4.0F * static_cast<float>(k) / kSide - 2.0F;
      mesh.vertices.emplace_back(x, y, 0.1F * (x * x + y * y));
    }
  for (std::uint32_t i = 0; i < kSide; ++i)
    for (std::uint32_t k = 0; k < kSide; ++k) {
      const std::uint32_t at = i * (kSide + 1) + k;
      mesh.triangles.push_back({{at, at + kSide + 1, at + 1}, white});
      mesh.triangles.push_back({{at + 1, at + kSide + 1, at + kSide + 2}, white});
    }
  const std::vector<Material> table{
      measured("white", [](const auto&, const auto&) { return 0.3 / kPi; })};
  TracedTarget target(mesh, table);
  add_mesh_levels(target, table, spec);
  EXPECT_TRUE(target.coarser.empty());
  const std::vector<Material> lambert{test_support::lambert_material("white", 0.3)};
  TracedTarget other(mesh, lambert);
  add_mesh_levels(other, lambert, spec);
  EXPECT_FALSE(other.coarser.empty());
}

}  // namespace
}  // namespace engine
