#pragma once

#include <cstdint>
#include <string>

#include "engine/scene/mesh.h"

/// Meshes of as many triangles as a measurement asks for.
namespace bench {

/// The same surface in smaller triangles: at least `triangles` of them, and not many more. Edges
/// are halved, each for all that share it, so that what was closed stays closed; vertices at one
/// place become one. Pre: triangles <= 10 million.
[[nodiscard]] engine::Mesh subdivided(const engine::Mesh& mesh, std::size_t triangles);

/// Moves each vertex along its normal, by a normally distributed length of this rms. The same seed
/// makes the same mesh.
void wrinkle(engine::Mesh& mesh, double rms_m, std::uint64_t seed);

/// As engine::load_mesh reads it: PATH, and beside it PATH.mtl with the materials' names. False: it
/// cannot be written.
[[nodiscard]] bool write_obj(const engine::Mesh& mesh, const std::string& path);

}  // namespace bench
