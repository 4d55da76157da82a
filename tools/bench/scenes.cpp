#include "tools/bench/scenes.h"

namespace bench {

starloop::Scenario scenario_of(const std::string& name, const std::vector<std::string>& overrides) {
  starloop::CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/" + name + ".toml";
  options.overrides = overrides;
  return starloop::load_scenario(options);
}

}  // namespace bench
