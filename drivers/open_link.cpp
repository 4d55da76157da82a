#include "drivers/open_link.h"

#include <algorithm>

#include "drivers/client/shm_layout.h"

namespace drivers {

LinkSpec read_link(const engine::ConfigTable& table) {
  LinkSpec spec;
  spec.kind = table.choice_or<LinkKind>("kind", "mock",
                                        {{"mock", LinkKind::kMock}, {"shm", LinkKind::kShm}});
  spec.name = table.text_or("name", spec.name);
  // The slash in front that shm_open(3) asks for is welcome, and no other.
  const std::string bare = spec.name.starts_with('/') ? spec.name.substr(1) : spec.name;
  if (bare.empty() || bare.size() > 200 || bare.starts_with('.') ||
      bare.find('/') != std::string::npos || bare.find('\0') != std::string::npos) {
    table.fail("name", "must be 1 to 200 characters without slash, the first no dot, got \"" +
                           spec.name + "\"");
  }
  spec.slots = static_cast<int>(
      table.integer_or("slots", spec.slots, engine::between(2, STARLOOP_SHM_MOST_SLOTS)));
  spec.telemetry_row = table.flag_or("telemetry_row", spec.telemetry_row);
  return spec;
}

OpenLink open_link(const LinkSpec& spec, int width_px, int height_px, WhenFull when_full) {
  if (spec.kind == LinkKind::kMock)
    return OpenLink(std::make_unique<MockLink>(width_px, height_px));
  return OpenLink(std::make_unique<ShmLink>(
      ShmSpec{.name = spec.name, .slots = spec.slots, .when_full = when_full}, width_px,
      height_px));
}

}  // namespace drivers
