#include "engine/render/render_spec.h"

#include <optional>
#include <utility>

#include "engine/core/contract.h"
#include "engine/render/bounce_depth.h"
#include "engine/render/bounced_light.h"
#include "engine/render/curved_renderer.h"
#include "engine/render/far_target.h"
#include "engine/render/lattice_renderer.h"
#include "engine/render/mesh_levels.h"
#include "engine/render/path_tracer.h"

namespace engine {

namespace {

bool is_auto(const ConfigTable& table, const std::string& key) {
  if (!table.is_text(key)) return false;
  return table.choice_or<bool>(key, "auto", {{"auto", true}});
}

}  // namespace

RenderSpec read_render(const ConfigTable& table) {
  RenderSpec spec;
  const auto method =
      table.choice_or<std::optional<RenderMethod>>("method", "auto",
                                                   {{"auto", std::nullopt},
                                                    {"lattice", RenderMethod::kLattice},
                                                    {"paths", RenderMethod::kPaths}});
  spec.method = method.value_or(RenderMethod::kLattice);
  spec.method_by_need = !method.has_value();
  spec.lattice_side =
      table.choice_or<int>("lattice", "auto", {{"auto", 0}, {"8x8", 8}, {"4x4", 4}, {"2x2", 2}});
  spec.profile = table.choice_or<RenderProfile>(
      "profile", "default",
      {{"default", {0.3, 0.19}}, {"reference", {0.1, 0.063}}, {"preview", {1.0, 0.63}}});
  const bool as_noise_asks = is_auto(table, "samples_per_pixel");
  spec.samples_per_pixel =
      as_noise_asks
          ? 0
          : static_cast<int>(table.integer_or("samples_per_pixel", 50, between(1, 100000)));
  spec.bounces_by_need = is_auto(table, "bounces");
  if (!spec.bounces_by_need)
    spec.bounces =
        static_cast<int>(table.integer_or("bounces", 1, between(0, BouncedLight::kMostBounces)));
  spec.sampler = table.choice_or<BrdfSampler>("sampler", "mis",
                                              {{"mis", BrdfSampler::kMixture},
                                               {"cosine", BrdfSampler::kCosine},
                                               {"uniform", BrdfSampler::kUniform},
                                               {"paper-cone", BrdfSampler::kPaperCone}});
  spec.sequence = table.choice_or<SequenceKind>(
      "sequence", "sobol",
      {{"sobol", SequenceKind::kSobol}, {"independent", SequenceKind::kIndependent}});
  spec.exact_caustics =
      table.choice_or<bool>("caustics", "spread", {{"spread", false}, {"exact", true}});
  spec.sun_disc = table.choice_or<SunDisc>(
      "sun_disc", "auto", {{"auto", SunDisc::kAuto}, {"on", SunDisc::kOn}, {"off", SunDisc::kOff}});
  spec.far_target = table.choice_or<FarTargetForm>("far_target", "auto",
                                                   {{"auto", FarTargetForm::kAuto},
                                                    {"resolved", FarTargetForm::kResolved},
                                                    {"point", FarTargetForm::kPoint}});
  spec.mesh_level = table.choice_or<MeshLevelChoice>(
      "mesh_level", "full", {{"auto", MeshLevelChoice::kAuto}, {"full", MeshLevelChoice::kFull}});
  spec.bounce_share = table.number_or("bounce_share", 0.15, between(0.001, 1.0));
  return spec;
}

std::unique_ptr<Renderer> make_renderer(const RenderSpec& spec,
                                        std::shared_ptr<TracedTarget> target, WorkerPool& pool,
                                        const OtherBodies& others) {
  RenderSpec settled = with_bounces_settled(spec, *target);
  const auto settle_for = [&](const TracedTarget& other) {
    const RenderSpec its = with_bounces_settled(spec, other);
    if (its.bounces > settled.bounces) settled = its;
  };
  for (const auto& companion : others.companions) settle_for(*companion);
  for (const OtherBodies::Part& part : others.parts) settle_for(*part.shape);
  ENSURE(settled.method == RenderMethod::kPaths || others.empty());
  const auto resolving = [&](const std::shared_ptr<TracedTarget>& shape) {
    std::unique_ptr<Renderer> made;
    if (settled.method == RenderMethod::kPaths) {
      made = std::make_unique<PathTracer>(settled, shape, pool, others);
    } else {
      made = std::make_unique<LatticeRenderer>(settled, shape, pool);
    }
    return made;
  };
  std::unique_ptr<Renderer> resolved = resolving(target);
  if (!target->coarser.empty() && others.empty()) {
    std::vector<std::unique_ptr<Renderer>> levels;
    levels.push_back(std::move(resolved));
    for (const CoarserTarget& level : target->coarser) levels.push_back(resolving(level.target));
    resolved = std::make_unique<LevelledRenderer>(settled, *target, std::move(levels));
  }
  // Bodies that may hide and shade each other have no light as a whole.
  const bool as_a_whole = settled.far_target != FarTargetForm::kResolved && others.empty();
  if (as_a_whole)
    resolved = std::make_unique<FarTarget>(settled, std::move(resolved), std::move(target), pool);
  if (settled.camera.distortion.none()) return resolved;
  return std::make_unique<CurvedRenderer>(settled.camera, settled.grid, std::move(resolved), pool);
}

}  // namespace engine
