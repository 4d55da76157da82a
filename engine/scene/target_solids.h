#pragma once

#include <map>
#include <string>

#include "engine/core/config_reader.h"
#include "engine/scene/sdf/solid.h"

namespace engine {

/// The shapes of a described target that the mesher makes: one of its own, or what is left when
/// solids that have a name are put together.
[[nodiscard]] bool is_only_meshed(const std::string& shape);
/// Reads the sizes of box, cylinder, disc, cone, sphere or torus; or `of`, two names or more, of a
/// union, an intersection or a difference, the first without the others. Not where it stands.
[[nodiscard]] Solid read_solid(const ConfigTable& table, const std::string& shape,
                               const std::map<std::string, Solid>& named);

/// At -x and at +x.
struct ConeRadii {
  double from_m = 0;
  double to_m = 0;
};
/// Of a cylinder, a disc or a cone; one of a cone's may be 0.
[[nodiscard]] ConeRadii read_radii(const ConfigTable& table, const std::string& shape);

}  // namespace engine
