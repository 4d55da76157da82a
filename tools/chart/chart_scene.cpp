#include "tools/chart/chart_scene.h"

#include <algorithm>
#include <cstdio>

#include "engine/core/config_reader.h"

namespace chart {

starloop::Scenario ChartScene::with(const std::vector<std::string>& sets) const {
  starloop::CommonOptions all = options;
  all.overrides.insert(all.overrides.end(), sets.begin(), sets.end());
  return starloop::load_scenario(all);
}

std::string ChartScene::command() const {
  char time[40];
  std::snprintf(time, sizeof time, " --time %.12g", time_s);
  std::string text = "starloop render " + options.file + time;
  for (const std::string& set : options.overrides) text += " --set '" + set + "'";
  return text;
}

ChartScene read_chart_scene(const std::filesystem::path& file) {
  const auto reader = engine::ConfigReader::from_file(file.string());
  const engine::ConfigTable table = reader.table("scene");
  ChartScene scene;
  scene.name = file.stem().string();
  scene.title = table.text("title");
  scene.options.file = (file.parent_path() / table.text("scenario")).lexically_normal().string();
  scene.options.overrides = table.texts("set");
  scene.options.quiet = true;
  scene.time_s = table.number("time_s", engine::between(0.0, 9e9));
  scene.corner = table.flag_or("corner", false);
  reader.reject_unknown_keys("a scene");
  try {
    static_cast<void>(scene.with({}));
  } catch (const engine::ConfigError& e) {
    throw engine::ConfigError(file.string() + ": " + e.what());
  }
  return scene;
}

std::vector<ChartScene> read_chart_scenes(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  if (files.empty())
    throw engine::ConfigError(folder.string() + ": expected a folder of scenes, *.toml, found " +
                              (error ? error.message() : "none in it"));
  std::sort(files.begin(), files.end());
  std::vector<ChartScene> scenes;
  for (const auto& file : files) scenes.push_back(read_chart_scene(file));
  return scenes;
}

}  // namespace chart
