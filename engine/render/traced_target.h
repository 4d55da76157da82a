#pragma once

#include <memory>
#include <vector>

#include "engine/render/embree_scene.h"
#include "engine/render/facets.h"
#include "engine/scene/material.h"
#include "engine/scene/mesh.h"

namespace engine {

struct TracedTarget;

/// The same target in fewer triangles.
struct CoarserTarget {
  std::shared_ptr<TracedTarget> target;
  double rms_m = 0;  ///< how far its surface is off, by area
  /// A facet that stands for a rough surface with a lobe narrower than that: a glint of it is the
  /// wrinkles', and no lobe makes up for them.
  struct Gloss {
    Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
    float reach_rad = 0;  ///< of a half vector, up to where it can be told
    float area_m2 = 0;
  };
  std::vector<Gloss> gloss;
};

/// How the mesh's materials scatter, by their index. `materials` must name every one of them:
/// ConfigError otherwise. Takes a tenth of a second for each that is not alike.
[[nodiscard]] std::vector<Brdf> brdfs_of(const Mesh& mesh, const std::vector<Material>& materials);

/// The target as renderers need it: triangles, what rays meet, and how facets reflect.
struct TracedTarget {
  /// As brdfs_of. May throw.
  TracedTarget(Mesh its_mesh, const std::vector<Material>& materials);
  /// One for each material of the mesh. May throw.
  TracedTarget(Mesh its_mesh, std::vector<Brdf> brdfs);

  Mesh mesh;
  double bounding_radius_m;
  EmbreeScene scene;
  Facets facets;
  std::vector<CoarserTarget> coarser;  ///< finest first; none unless somebody made them
};

}  // namespace engine
