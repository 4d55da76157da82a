#include "engine/render/mesh_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/render/far_target.h"
#include "engine/scene/simplified_mesh.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kFewTriangles = 20'000;
// One that has more of the triangles of the next finer is not worth its memory.
constexpr double kWorthwhile = 0.6;
constexpr std::size_t kMostLevels = 3;
// What bright light may be at most: in sunlight, in any band that a silicon detector sees.
constexpr double kSunlight_w_m2 = 600.0;
// Half of the variance of all model errors.
constexpr double kShareOfErrors = 0.707;

constexpr double kCoarserBelow = 1.0 / 1.5;
constexpr double kRangeGrown = 1.1;

// Of a lobe's half width.
constexpr double kGlossReach = 2.0;
// Facets that glint, in pixels: less is lost in what they stand for.
constexpr double kUnseenGlint_px2 = 0.05;
constexpr double kLeaveGlint = 1.2;

constexpr std::array<std::string_view, kMostLevels + 1> kNames{"full", "coarser", "coarser still",
                                                               "coarsest"};

/// In sigmas, of a pixel's noise, where the surface is off by so much.
double error_sigmas(const RenderSpec& spec, double off_px, double light_e) noexcept {
  const double light = std::min(light_e, spec.noise.full_well_e);
  return light > 0.0 ? LevelledRenderer::kOnTop * off_px * light / spec.noise.sigma_e(light) : 0.0;
}

double brightest_of(const TracedTarget& target) noexcept {
  double brightest = 0;
  for (std::uint32_t m = 0; m < target.mesh.material_names.size(); ++m)
    brightest = std::max(brightest, target.facets.brdf(m).diffuse_albedo() / kPi);
  return brightest;
}

std::vector<CoarserTarget::Gloss> gloss_of(const SimplifiedMesh& mesh, const TracedTarget& original,
                                           const TracedTarget& coarse) {
  std::vector<CoarserTarget::Gloss> gloss;
  for (std::uint32_t i = 0; i < coarse.mesh.triangles.size(); ++i) {
    const std::uint32_t material = coarse.mesh.triangles[i].material;
    const SimplifiedMesh::Surface& surface = mesh.surfaces[material];
    const double own_rad = original.facets.brdf(surface.original).lobe_half_width_rad();
    const double wide_rad = coarse.facets.brdf(material).lobe_half_width_rad();
    if (!(wide_rad > own_rad)) continue;
    gloss.push_back({coarse.facets.on_side(i, 0, 0, 0).normal,
                     static_cast<float>(kGlossReach * wide_rad),
                     static_cast<float>(coarse.facets.area_m2(i))});
  }
  return gloss;
}

/// Whether enough normals are near a half vector of camera and brighter lamp. A facet may be seen
/// from behind.
bool glints(const std::vector<CoarserTarget::Gloss>& gloss, const Snapshot& snapshot,
            double unseen_m2, double margin) noexcept {
  const bool by_sun = snapshot.sun.irradiance_w_m2 >= snapshot.earthshine.irradiance_w_m2;
  const Lamp& lamp = by_sun ? snapshot.sun : snapshot.earthshine;
  if (!(lamp.irradiance_w_m2 > 0.0)) return false;
  const Eigen::Vector3f half =
      (lamp.toward.unit + snapshot.camera.m.normalized()).normalized().cast<float>();
  double area_m2 = 0;
  for (const CoarserTarget::Gloss& g : gloss) {
    const float reach_rad = std::min(static_cast<float>(margin) * g.reach_rad, 1.5F);
    if (half.cross(g.normal).norm() < std::sin(reach_rad))
      area_m2 += static_cast<double>(g.area_m2);
  }
  return area_m2 > unseen_m2;
}

}  // namespace

void add_mesh_levels(TracedTarget& target, const std::vector<Material>& materials,
                     const RenderSpec& spec) {
  const std::size_t triangles = target.mesh.triangles.size();
  const double light_e = kSunlight_w_m2 * brightest_of(target) * spec.noise.e_per_radiance;
  if (triangles < kFewTriangles || !(light_e > 0.0)) return;
  // A measured lobe cannot be made as wide as the normals of what a facet stands for.
  const auto is_measured = [&](const std::string& name) {
    const auto it = std::ranges::find(materials, name, &Material::name);
    return it != materials.end() && it->table != nullptr;
  };
  if (std::ranges::any_of(target.mesh.material_names, is_measured)) return;
  const double limit_px =
      kShareOfErrors * spec.profile.rho_total / error_sigmas(spec, 1.0, light_e);
  const MeshSimplifier simplifier(target.mesh, materials);
  // From the size on where FarTarget ends; then for cameras twice as near.
  double rms_m = limit_px * 2.0 * target.bounding_radius_m / FarTarget::kLargest_px;
  std::vector<CoarserTarget> made;
  double last_share = 0;  // of the target's triangles
  // Half the deviation takes about twice the triangles.
  for (std::size_t i = 0; i < kMostLevels && 1.5 * last_share < kWorthwhile; ++i, rms_m *= 0.5) {
    const SimplifiedMesh simplified = simplifier.to(rms_m);
    const double share =
        static_cast<double>(simplified.mesh.triangles.size()) / static_cast<double>(triangles);
    if (share > kWorthwhile) break;
    // A finer one that is hardly larger stands for both.
    if (!made.empty() && last_share > kWorthwhile * share) made.pop_back();
    CoarserTarget level;
    level.target = std::make_shared<TracedTarget>(simplified.mesh, simplified.materials);
    level.rms_m = simplified.rms_m;
    level.gloss = gloss_of(simplified, target, *level.target);
    made.push_back(std::move(level));
    last_share = share;
  }
  std::ranges::reverse(made);
  target.coarser = std::move(made);
}

LevelledRenderer::LevelledRenderer(const RenderSpec& spec, const TracedTarget& target,
                                   std::vector<std::unique_ptr<Renderer>> renderers)
    : spec_(spec), brightest_(brightest_of(target)) {
  ENSURE(renderers.size() == target.coarser.size() + 1 && renderers.size() <= kNames.size());
  for (std::size_t i = 0; i < renderers.size(); ++i) {
    Level level;
    level.renderer = std::move(renderers[i]);
    if (i > 0) level.rms_m = target.coarser[i - 1].rms_m;
    if (i > 0) level.gloss = target.coarser[i - 1].gloss;
    levels_.push_back(std::move(level));
  }
}

RenderReport LevelledRenderer::render(const Snapshot& snapshot, Budget budget,
                                      Radiance& out) noexcept {
  const double light_e = brightest_ * spec_.noise.e_per_radiance *
                         (snapshot.sun.irradiance_w_m2 + snapshot.earthshine.irradiance_w_m2);
  level_ = choose(snapshot, light_e);
  const Level& level = levels_[level_];
  RenderReport report = level.renderer->render(snapshot, budget, out);
  const double sigma_e = spec_.noise.sigma_e(std::min(light_e, spec_.noise.full_well_e));
  report.add(
      {"mesh", kNames[level_], sigma_e * error_sigmas(spec_, off_px(level, snapshot), light_e)});
  return report;
}

double LevelledRenderer::off_px(const Level& level, const Snapshot& snapshot) const noexcept {
  return level.rms_m / (snapshot.camera.m.norm() * spec_.camera.ifov_rad());
}

std::size_t LevelledRenderer::choose(const Snapshot& snapshot, double light_e) noexcept {
  const double limit = kShareOfErrors * spec_.profile.rho_total;
  const double range_m = snapshot.camera.m.norm();
  const double unseen_m2 = kUnseenGlint_px2 * std::pow(range_m * spec_.camera.ifov_rad(), 2);
  const auto fits = [&](const Level& level, double below, double margin) {
    // Not a number does not.
    return error_sigmas(spec_, off_px(level, snapshot), light_e) <= below &&
           !glints(level.gloss, snapshot, unseen_m2, margin);
  };
  const auto coarsest = [&](double below, double margin) {
    std::size_t level = levels_.size() - 1;
    while (level > 0 && !fits(levels_[level], below, margin)) --level;
    return level;
  };
  const std::size_t needed = coarsest(limit, 1.0);
  if (!std::exchange(any_, true)) return needed;
  if (needed < level_) {
    refined_at_m_ = range_m;
    return needed;
  }
  if (range_m > kRangeGrown * refined_at_m_)
    return std::max(level_, coarsest(kCoarserBelow * limit, kLeaveGlint));
  return level_;
}

}  // namespace engine
