#include "engine/scene/target_solids.h"

#include <vector>

namespace engine {
namespace {

constexpr std::size_t kMostNodes = 200;

Range length() {
  Range r = positive();
  r.high = 10'000.0;
  return r;
}

Solid put_together(const ConfigTable& t, const std::string& shape,
                   const std::map<std::string, Solid>& named) {
  const std::vector<std::string> names = t.texts("of");
  if (names.size() < 2) t.fail("of", "must be the names of two solids or more");
  const auto solid = [&](const std::string& name) -> const Solid& {
    const auto it = named.find(name);
    if (it == named.end()) t.fail("of", "must have names of [solids] above, got \"" + name + "\"");
    return it->second;
  };
  Solid all = solid(names[0]);
  for (std::size_t i = 1; i < names.size(); ++i) {
    const Solid& next = solid(names[i]);
    all = shape == "union"          ? all.united(next)
          : shape == "intersection" ? all.shared(next)
                                    : all.cut_by(next);
    if (all.nodes() > kMostNodes) t.fail("of", "puts over a hundred solids together");
  }
  return all;
}

}  // namespace

bool is_only_meshed(const std::string& shape) {
  return shape == "sphere" || shape == "torus" || shape == "union" || shape == "difference" ||
         shape == "intersection";
}

ConeRadii read_radii(const ConfigTable& t, const std::string& shape) {
  if (shape != "cone") {
    const double radius_m = t.number("radius_m", length());
    return {radius_m, radius_m};
  }
  const auto radii_m = t.numbers("radii_m", 2, between(0.0, length().high));
  if (radii_m[0] + radii_m[1] <= 0.0) t.fail("radii_m", "must have one that is > 0");
  return {radii_m[0], radii_m[1]};
}

Solid read_solid(const ConfigTable& t, const std::string& shape,
                 const std::map<std::string, Solid>& named) {
  if (shape == "union" || shape == "difference" || shape == "intersection")
    return put_together(t, shape, named);
  if (shape == "box") {
    const auto size = t.numbers("size_m", 3, length());
    return Solid::box({size[0], size[1], size[2]});
  }
  if (shape == "sphere") return Solid::sphere(t.number("radius_m", length()));
  if (shape == "torus") {
    const double ring_m = t.number("ring_radius_m", length());
    const double tube_m = t.number("tube_radius_m", length());
    if (tube_m >= ring_m) t.fail("tube_radius_m", "must be less than ring_radius_m");
    return Solid::torus(ring_m, tube_m);
  }
  if (shape != "cylinder" && shape != "disc" && shape != "cone")
    t.fail("shape",
           "of a solid must be box, cylinder, disc, cone, sphere, torus, union, "
           "difference or intersection, got \"" +
               shape + "\"");
  const ConeRadii radii = read_radii(t, shape);
  return Solid::cone(radii.from_m, radii.to_m,
                     t.number(shape == "disc" ? "thickness_m" : "length_m", length()));
}

}  // namespace engine
