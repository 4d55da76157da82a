#include "tools/chart/knobs.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/core/random.h"

namespace chart {
namespace {

/// Rungs that are words of one key.
Knob knob_of(const std::string& name, const std::string& key, const std::vector<std::string>& words,
             std::size_t standard, std::vector<std::string> with = {}) {
  Knob knob{.name = name, .rungs = {}, .standard = standard, .with = std::move(with)};
  for (const std::string& word : words) knob.rungs.push_back({word, {key + "=" + word}});
  return knob;
}

std::vector<Knob> make_knobs() {
  const std::vector<std::string> paths = {"render.method=paths"};
  return {
      knob_of("method", "render.method", {"auto", "lattice", "paths"}, 0),
      knob_of("profile", "render.profile", {"preview", "default", "reference"}, 1),
      knob_of("lattice", "render.lattice", {"2x2", "4x4", "8x8", "auto"}, 3),
      knob_of("samples", "render.samples_per_pixel", {"9", "50", "200", "auto"}, 1, paths),
      knob_of("sampler", "render.sampler", {"paper-cone", "uniform", "cosine", "mis"}, 3, paths),
      knob_of("sequence", "render.sequence", {"independent", "sobol"}, 1, paths),
      knob_of("caustics", "render.caustics", {"spread", "exact"}, 0, paths),
      knob_of("bounces", "render.bounces", {"0", "1", "2", "auto"}, 1),
      knob_of("sun disc", "render.sun_disc", {"off", "on", "auto"}, 2),
      knob_of("earthshine", "earth.earthshine",
              {"none", "paper-lamp", "vector", "harmonics", "cap", "auto"}, 5),
      knob_of("far target", "render.far_target", {"point", "resolved", "auto"}, 2),
      knob_of("mesh level", "render.mesh_level", {"auto", "full"}, 1),
      knob_of("grid", "optics.grid", {"paper-grid", "2x2", "4x4", "fine"}, 3),
      knob_of("wings", "optics.largest_wing_px", {"16", "64", "256", "512"}, 2),
      knob_of("shadow", "visibility.shadow", {"cylinder", "cone", "oblate-cone"}, 2),
      knob_of("sun place", "sun.position", {"table-1", "erfa"}, 1),
      knob_of("light path", "scenario.light_path", {"geometric", "apparent"}, 1),
  };
}

void add_sets(const Knob& knob, std::size_t rung, std::vector<std::string>& sets) {
  const auto& more = knob.rungs[rung].sets;
  sets.insert(sets.end(), more.begin(), more.end());
}

}  // namespace

const std::vector<Knob>& all_knobs() {
  static const std::vector<Knob> knobs = make_knobs();
  return knobs;
}

Setting standard_setting() {
  Setting setting{.name = "standard", .knob = {}, .rungs = {}, .sets = {}};
  for (const Knob& knob : all_knobs()) setting.rungs.push_back(knob.standard);
  return setting;
}

std::vector<Setting> single_settings() {
  std::vector<Setting> settings;
  const std::vector<Knob>& knobs = all_knobs();
  for (std::size_t k = 0; k < knobs.size(); ++k) {
    for (std::size_t r = 0; r < knobs[k].rungs.size(); ++r) {
      // What needs another method is off the standard with its standard rung, too.
      if (r == knobs[k].standard && knobs[k].with.empty()) continue;
      Setting setting = standard_setting();
      setting.name = knobs[k].name + "=" + knobs[k].rungs[r].name;
      setting.knob = knobs[k].name;
      setting.rungs[k] = r;
      setting.sets = knobs[k].with;
      add_sets(knobs[k], r, setting.sets);
      settings.push_back(std::move(setting));
    }
  }
  return settings;
}

std::vector<Setting> mixed_settings(std::size_t count, std::uint64_t seed) {
  std::vector<Setting> settings(count);
  for (std::size_t i = 0; i < count; ++i) {
    settings[i].name = "mix " + std::to_string(i + 1);
  }
  const std::vector<Knob>& knobs = all_knobs();
  for (std::size_t k = 0; k < knobs.size(); ++k) {
    engine::Draws draws(seed, engine::Stream::kCharts, 0, static_cast<std::uint32_t>(k));
    std::vector<std::size_t> layer(count);
    std::iota(layer.begin(), layer.end(), std::size_t{0});
    for (std::size_t i = count; i > 1; --i)
      std::swap(layer[i - 1],
                layer[static_cast<std::size_t>(draws.uniform_double() * static_cast<double>(i))]);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t rung = layer[i] * knobs[k].rungs.size() / count;
      settings[i].rungs.push_back(rung);
      add_sets(knobs[k], rung, settings[i].sets);
    }
  }
  return settings;
}

Setting reference_setting(int samples_per_pixel) {
  Setting setting = standard_setting();
  setting.name = "reference";
  setting.sets = {
      "render.method=paths",       "render.samples_per_pixel=" + std::to_string(samples_per_pixel),
      "render.bounce_share=1",     "render.bounces=4",
      "render.sun_disc=on",        "render.far_target=resolved",
      "render.mesh_level=full",    "render.profile=reference",
      "earth.earthshine=cap",      "optics.grid=6x6",
      "optics.largest_wing_px=512"};
  return setting;
}

}  // namespace chart
