#pragma once

#include <vector>

#include "engine/render/embree_scene.h"
#include "engine/render/facets.h"
#include "engine/scene/mesh.h"

namespace engine {

/// The target as renderers need it: triangles, what rays meet, and how facets reflect.
struct TracedTarget {
  /// `materials` must name every material of the mesh: ConfigError otherwise. May throw.
  TracedTarget(Mesh its_mesh, const std::vector<Material>& materials);

  Mesh mesh;
  double bounding_radius_m;
  EmbreeScene scene;
  Facets facets;
};

}  // namespace engine
