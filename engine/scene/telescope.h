#pragma once

#include "engine/scene/described_target.h"

namespace engine {

/// The default target, a space telescope much like Hubble: data/targets/telescope.toml says how it
/// stands in its body frame, what it is made of, where its sizes are from and what is left out.
/// Every part is a closed solid; parts reach into one another where they join. Under 15 000
/// triangles.
[[nodiscard]] inline Mesh telescope_mesh() { return described_target("telescope").mesh; }

}  // namespace engine
