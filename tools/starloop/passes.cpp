#include <cstdio>

#include <nlohmann/json.hpp>

#include "engine/orbit/utc.h"
#include "tools/starloop/subcommands.h"

namespace starloop {

int list_passes(const CommonOptions& options, bool as_json) {
  using engine::seconds;
  const Scenario scenario = load_scenario(options);
  const std::vector<engine::Pass> passes = passes_of(scenario);
  if (as_json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const engine::Pass& p : passes) {
      list.push_back({{"start_s", seconds(p.start)},
                      {"end_s", seconds(p.end)},
                      {"duration_s", seconds(p.end - p.start)},
                      {"closest_s", seconds(p.closest)},
                      {"min_range_km", p.min_range_m * 1e-3},
                      {"start_limited_by", name_of(p.start_limited_by)},
                      {"end_limited_by", name_of(p.end_limited_by)}});
    }
    std::printf("%s\n", list.dump(2).c_str());
    return kGood;
  }
  if (!options.quiet) {
    std::printf("%zu passes in %.6g days from %s UTC, closer than %.6g km, target lit:\n",
                passes.size(), seconds(scenario.search_span) / 86400.0,
                engine::utc_text(scenario.scene.epoch).c_str(),
                scenario.visibility.max_range_m * 1e-3);
  }
  std::printf("%4s  %-23s %15s %15s %9s %15s %11s  %s\n", "pass", "start, UTC", "start, s",
              "end, s", "lasts, s", "closest, s", "range, km", "limited by");
  std::size_t number = 0;
  for (const engine::Pass& p : passes) {
    std::printf("%4zu  %-23s %15.3f %15.3f %9.3f %15.3f %11.3f  %s, %s\n", ++number,
                engine::utc_text(scenario.scene.epoch + p.start.time_since_epoch()).c_str(),
                seconds(p.start), seconds(p.end), seconds(p.end - p.start), seconds(p.closest),
                p.min_range_m * 1e-3, name_of(p.start_limited_by).data(),
                name_of(p.end_limited_by).data());
  }
  return kGood;
}

}  // namespace starloop
