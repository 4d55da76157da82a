#include "engine/scene/built_in_targets.h"

#include <array>
#include <cstddef>

#define STARLOOP_TARGET(name)                 \
  extern const char starloop_target_##name[]; \
  extern const char starloop_target_##name##_end[];

extern "C" {
STARLOOP_TARGET(cubesat)
STARLOOP_TARGET(plate)
STARLOOP_TARGET(rocket_body)
STARLOOP_TARGET(sphere)
STARLOOP_TARGET(telescope)
}

namespace engine {
namespace {

struct Entry {
  const char* name;
  const char* begin;
  const char* end;
};
const std::array<Entry, 5> kTargets = {
    {{"cubesat", starloop_target_cubesat, starloop_target_cubesat_end},
     {"plate", starloop_target_plate, starloop_target_plate_end},
     {"rocket_body", starloop_target_rocket_body, starloop_target_rocket_body_end},
     {"sphere", starloop_target_sphere, starloop_target_sphere_end},
     {"telescope", starloop_target_telescope, starloop_target_telescope_end}}};

}  // namespace

std::vector<std::string> built_in_targets() {
  std::vector<std::string> names;
  names.reserve(kTargets.size());
  for (const Entry& entry : kTargets) names.emplace_back(entry.name);
  return names;
}

std::string_view built_in_target_text(const std::string& name) noexcept {
  for (const Entry& entry : kTargets)
    if (name == entry.name) return {entry.begin, static_cast<std::size_t>(entry.end - entry.begin)};
  return {};
}

}  // namespace engine
