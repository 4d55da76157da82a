#include "engine/render/mesh_levels.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/render/path_tracer.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kSun_w_m2 = 600.0;
const std::vector<Material> kWhite = {test_support::lambert_material("white", 0.3)};

/// The paper's sensor behind a small frame.
RenderSpec small_spec(int side_px) {
  RenderSpec spec;
  spec.camera = test_support::small_camera(side_px);
  spec.grid = {3, 4};
  spec.noise = {258.0, 22.0, 30000.0, 0.675};
  spec.bounces = 0;
  spec.mesh_level = MeshLevelChoice::kAuto;
  spec.far_target = FarTargetForm::kResolved;
  return spec;
}

/// 12 m across, of 360 flat faces in 64 triangles each.
Mesh fine_ball() {
  Mesh mesh = test_support::sphere(6.0F, 10, 20, "white");
  for (int round = 0; round < 3; ++round) {
    std::vector<Mesh::Triangle> finer;
    for (const Mesh::Triangle& t : mesh.triangles) {
      const auto [a, b, c] = t.corner;
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.emplace_back(0.5F * (mesh.vertices[a] + mesh.vertices[b]));
      mesh.vertices.emplace_back(0.5F * (mesh.vertices[b] + mesh.vertices[c]));
      mesh.vertices.emplace_back(0.5F * (mesh.vertices[c] + mesh.vertices[a]));
      finer.push_back({{a, first, first + 2}, t.material});
      finer.push_back({{first, b, first + 1}, t.material});
      finer.push_back({{first + 2, first + 1, c}, t.material});
      finer.push_back({{first, first + 1, first + 2}, t.material});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

Snapshot seen_from(const RenderSpec& spec, double size_px) {
  const double range_m = 12.0 * spec.camera.pixels_per_radian() / size_px;
  Snapshot snapshot =
      test_support::look_at_origin(range_m * Vector3d(0.5, 0.4, 0.77).normalized(), {0, 1, 0});
  snapshot.sun = {direction_of<BodyFrame>({0.9, 0.1, 0.4}), kSun_w_m2};
  return snapshot;
}

std::string mesh_of(const RenderReport& report) {
  const auto it = std::ranges::find(report.rungs, "mesh", &Rung::ladder);
  return it == report.rungs.end() ? "" : std::string(it->taken);
}

/// Says which of several it is by the number of bounces.
class Named final : public Renderer {
 public:
  explicit Named(int name) : name_(name) {}
  RenderReport render(const Snapshot& /*snapshot*/, Budget /*budget*/,
                      Radiance& /*out*/) noexcept override {
    RenderReport report;
    report.bounces = name_;
    return report;
  }

 private:
  int name_;
};

/// Levels of 1 and 4 mm rms of a target of 12 m.
LevelledRenderer two_levels(const RenderSpec& spec, TracedTarget& target) {
  target.coarser = {{nullptr, 1e-3, {}}, {nullptr, 4e-3, {}}};
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (int i = 0; i < 3; ++i) renderers.push_back(std::make_unique<Named>(i));
  return {spec, target, std::move(renderers)};
}

TEST(LevelledRenderer, AnApproachTakesEachMeshOnceAndStaysWithTheFinest) {
  const RenderSpec spec = small_spec(32);
  TracedTarget target(test_support::sphere(6.0F, 8, 16, "white"), kWhite);
  LevelledRenderer renderer = two_levels(spec, target);
  Radiance out;
  std::vector<int> taken;
  const auto look = [&](double size_px) {
    const int level = renderer.render(seen_from(spec, size_px), {}, out).bounces;
    if (taken.empty() || taken.back() != level) taken.push_back(level);
  };
  // With the range noisy by 2 %, nearer by half a per cent a frame.
  double size_px = 2.0;
  for (int i = 0; i < 1100; ++i, size_px *= 1.005) look(size_px * (i % 2 == 0 ? 1.02 : 1.0));
  EXPECT_EQ(taken, (std::vector<int>{2, 1, 0}));
  // Away again each comes back, once.
  for (int i = 0; i < 1100; ++i, size_px /= 1.005) look(size_px * (i % 2 == 0 ? 1.02 : 1.0));
  EXPECT_EQ(taken, (std::vector<int>{2, 1, 0, 1, 2}));
}

TEST(LevelledRenderer, TheErrorItTellsIsThatOfTheRuleAndUnderItsShare) {
  const RenderSpec spec = small_spec(32);
  TracedTarget target(test_support::sphere(6.0F, 8, 16, "white"), kWhite);
  const double light_e = kSun_w_m2 * 0.3 / kPi * 258.0;
  const double most_e = 0.707 * 0.3 * std::sqrt(light_e + 22.0);
  for (const double size_px : {1.0, 5.0, 20.0, 100.0}) {
    LevelledRenderer renderer = two_levels(spec, target);
    Radiance out;
    const Snapshot view = seen_from(spec, size_px);
    const RenderReport report = renderer.render(view, {}, out);
    const auto rung = std::ranges::find(report.rungs, "mesh", &Rung::ladder);
    ASSERT_NE(rung, report.rungs.end());
    const double rms_m = report.bounces == 0 ? 0.0 : report.bounces == 1 ? 1e-3 : 4e-3;
    const double want_e = LevelledRenderer::kOnTop * rms_m / 12.0 * size_px * light_e;
    EXPECT_NEAR(rung->error_e, want_e, 1e-6 * light_e) << size_px;
    EXPECT_LE(rung->error_e, most_e) << size_px;
  }
}

TEST(LevelledRenderer, AGlintOfWhatWasSmoothedIsTheFinestMeshs) {
  const RenderSpec spec = small_spec(32);
  TracedTarget target(test_support::sphere(6.0F, 8, 16, "white"), kWhite);
  for (const double off_deg : {0.0, 4.0, 8.0}) {
    target.coarser = {{nullptr, 1e-3, {}}};
    Snapshot view = seen_from(spec, 4.0);
    const Vector3d half = (view.sun.toward.unit + view.camera.m.normalized()).normalized();
    const Vector3d normal = Eigen::AngleAxisd(off_deg * kDegree, half.unitOrthogonal()) * half;
    target.coarser[0].gloss = {{normal.cast<float>(), static_cast<float>(5.0 * kDegree), 10.0F}};
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (int i = 0; i < 2; ++i) renderers.push_back(std::make_unique<Named>(i));
    LevelledRenderer renderer(spec, target, std::move(renderers));
    Radiance out;
    EXPECT_EQ(renderer.render(view, {}, out).bounces, off_deg < 5.0 ? 0 : 1) << off_deg;
  }
}

TEST(MeshLevels, AreForFineMeshesAndKnownSensors) {
  TracedTarget coarse(test_support::sphere(6.0F, 20, 40, "white"), kWhite);
  add_mesh_levels(coarse, kWhite, small_spec(32));
  EXPECT_TRUE(coarse.coarser.empty());
  TracedTarget fine(fine_ball(), kWhite);
  RenderSpec unknown = small_spec(32);
  unknown.noise = {};
  add_mesh_levels(fine, kWhite, unknown);
  EXPECT_TRUE(fine.coarser.empty());
}

TEST(MeshLevels, PicturesOnBothSidesOfASwitchDifferByLessThanTheRuleAllows) {
  const RenderSpec spec = [] {
    RenderSpec s = small_spec(48);
    s.samples_per_pixel = 576;
    return s;
  }();
  auto target = std::make_shared<TracedTarget>(fine_ball(), kWhite);
  add_mesh_levels(*target, kWhite, spec);
  ASSERT_FALSE(target->coarser.empty());
  EXPECT_LT(target->coarser[0].target->mesh.triangles.size(),
            target->mesh.triangles.size() * 6 / 10);
  WorkerPool pool(2);
  const auto renderer = make_renderer(spec, target, pool);
  PathTracer full(spec, target, pool);
  Radiance levelled;
  Radiance finest;
  // The nearest at which a coarser mesh is taken.
  double size_px = 44.0;
  while (size_px > 10.0) {
    if (mesh_of(renderer->render(seen_from(spec, size_px), {}, levelled)) != "full") break;
    size_px -= 2.0;
  }
  ASSERT_GT(size_px, 10.0);
  full.render(seen_from(spec, size_px), {}, finest);
  ASSERT_EQ(levelled.grid.width(), finest.grid.width());
  ASSERT_EQ(levelled.grid.height(), finest.grid.height());
  double squares = 0;
  double lit = 0;
  double flux = 0;
  double full_flux = 0;
  for (int v = 0; v < finest.grid.height(); v += 3) {
    for (int u = 0; u < finest.grid.width(); u += 3) {
      double was = 0;
      double is = 0;
      for (int k = 0; k < 9; ++k) {
        was += static_cast<double>(finest.grid.at(u + k % 3, v + k / 3)) / 9.0 * 258.0;
        is += static_cast<double>(levelled.grid.at(u + k % 3, v + k / 3)) / 9.0 * 258.0;
      }
      flux += is;
      full_flux += was;
      if (was < 30.0) continue;
      squares += std::pow(is - was, 2) / (was + 22.0);
      ++lit;
    }
  }
  EXPECT_NEAR(flux / full_flux, 1.0, 0.005);
  // The profile's limit for all model errors. The samples are the same, and their noise nearly so.
  EXPECT_LT(std::sqrt(squares / lit), 0.3);
}

}  // namespace
}  // namespace engine
