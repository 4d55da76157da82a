#include "engine/render/render_spec.h"

#include <utility>

#include "engine/render/lattice_renderer.h"
#include "engine/render/path_tracer.h"

namespace engine {

RenderSpec read_render(const ConfigTable& table) {
  RenderSpec spec;
  spec.method = table.choice_or<RenderMethod>(
      "method", "paths", {{"lattice", RenderMethod::kLattice}, {"paths", RenderMethod::kPaths}});
  spec.lattice_side = table.choice_or<int>("lattice", "8x8", {{"8x8", 8}, {"4x4", 4}, {"2x2", 2}});
  spec.bounce_paths = static_cast<int>(table.integer_or("bounce_paths", 64, between(0, 4096)));
  spec.samples_per_pixel =
      static_cast<int>(table.integer_or("samples_per_pixel", 50, between(1, 100000)));
  spec.bounces = static_cast<int>(table.integer_or("bounces", 1, between(0, 16)));
  spec.bounce_share = table.number_or("bounce_share", 0.15, between(0.001, 1.0));
  return spec;
}

std::unique_ptr<Renderer> make_renderer(const RenderSpec& spec,
                                        std::shared_ptr<TracedTarget> target, WorkerPool& pool) {
  if (spec.method == RenderMethod::kPaths)
    return std::make_unique<PathTracer>(spec, std::move(target), pool);
  return std::make_unique<LatticeRenderer>(spec, std::move(target), pool);
}

}  // namespace engine
