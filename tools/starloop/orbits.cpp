#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "engine/core/contract.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;

constexpr double kDay_s = 86400.0;
constexpr int kRows = 360;  // of a day, and of the whole span

/// A body of the scenario by each model that it can be computed by.
struct Body {
  std::string name;
  std::string own;  ///< the scenario's model
  std::map<std::string, std::unique_ptr<const engine::Propagator>> models;
};

/// Where a reference has a body.
struct ReferenceRow {
  std::string body;
  double t_s = 0;
  Eigen::Vector3d m;
};

std::vector<Body> bodies_of(const Scenario& scenario) {
  std::vector<Body> bodies;
  for (const auto& [name, orbit] :
       {std::pair{"camera", &scenario.camera_orbit}, std::pair{"target", &scenario.target_orbit}}) {
    Body body{name, std::string(name_of(orbit->model)), {}};
    body.models[body.own] = propagator_of(scenario, *orbit);
    if (orbit->model != engine::OrbitModel::kEphemeris) {
      for (const auto model : {engine::OrbitModel::kTwoBody, engine::OrbitModel::kJ2}) {
        engine::OrbitSpec other = *orbit;
        other.model = model;
        body.models[std::string(name_of(model))] = propagator_of(scenario, other);
      }
    }
    bodies.push_back(std::move(body));
  }
  return bodies;
}

[[noreturn]] void fail_at(const std::string& path, int line, const std::string& complaint) {
  throw engine::ConfigError(path + ":" + std::to_string(line) + ": " + complaint);
}

/// A comma-separated table with columns body ("camera" or "target"), t_s, x_km, y_km, z_km, and
/// whatever else.
std::vector<ReferenceRow> read_reference(const std::string& path, double last_s) {
  std::ifstream file(path);
  if (!file) throw engine::ConfigError(path + ": expected a table, found no file to read");
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    if (!cells.empty() && cells.back().ends_with('\r')) cells.back().pop_back();
    return cells;
  };
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> names = cells_of(line);
  constexpr std::array<const char*, 5> kColumns{"body", "t_s", "x_km", "y_km", "z_km"};
  std::array<std::size_t, 5> column{};
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    column[i] = static_cast<std::size_t>(std::find(names.begin(), names.end(), kColumns[i]) -
                                         names.begin());
    if (column[i] == names.size())
      fail_at(path, 1, std::string("expected a column ") + kColumns[i] + ", found none");
  }
  std::vector<ReferenceRow> rows;
  for (int number = 2; std::getline(file, line); ++number) {
    const auto fail = [&](const std::string& complaint) { fail_at(path, number, complaint); };
    const std::vector<std::string> cells = cells_of(line);
    if (cells.empty()) continue;
    if (cells.size() != names.size())
      fail("expected " + std::to_string(names.size()) + " cells, found " +
           std::to_string(cells.size()));
    std::array<double, 4> values{};
    for (std::size_t i = 1; i < kColumns.size(); ++i) {
      const std::string& cell = cells[column[i]];
      char* end = nullptr;
      values[i - 1] = std::strtod(cell.c_str(), &end);
      if (cell.empty() || *end != '\0' || !(std::abs(values[i - 1]) < 1e9))
        fail("expected a number for " + std::string(kColumns[i]) + ", found \"" +
             cell.substr(0, 60) + "\"");
    }
    ReferenceRow row{cells[column[0]], values[0],
                     1e3 * Eigen::Vector3d(values[1], values[2], values[3])};
    if (row.body != "camera" && row.body != "target")
      fail("expected body to be camera or target, found \"" + row.body.substr(0, 60) + "\"");
    if (row.t_s < 0.0 || row.t_s > last_s)
      fail("expected a time from 0 to the scenario's visibility.span_days, found " +
           cells[column[1]] + " s");
    rows.push_back(std::move(row));
  }
  return rows;
}

/// The scenario's own model against the others, over a day and over the span.
std::vector<ReferenceRow> own_rows(const std::vector<Body>& bodies, engine::Epoch epoch,
                                   double last_s) {
  std::vector<ReferenceRow> rows;
  for (const Body& body : bodies) {
    for (const double whole_s : {std::min(kDay_s, last_s), last_s}) {
      for (int i = 0; i <= kRows; ++i) {
        const double t_s = whole_s * i / kRows;
        const engine::Epoch t = epoch + engine::from_seconds(t_s);
        rows.push_back({body.name, t_s, body.models.at(body.own)->at(t).position.m});
      }
      if (last_s <= kDay_s) break;
    }
  }
  return rows;
}

/// The largest, by body and model.
using Worst = std::map<std::string, double>;

Worst write_rows(const std::string& path, const std::vector<Body>& bodies, engine::Epoch epoch,
                 const std::vector<ReferenceRow>& rows, bool to_itself) {
  std::ofstream csv(path);
  csv.precision(12);
  csv << "body,model,t_s,error_m\n";
  Worst worst;
  for (const ReferenceRow& row : rows) {
    const Body& body = row.body == "camera" ? bodies[0] : bodies[1];
    for (const auto& [model, propagator] : body.models) {
      if (to_itself && model == body.own) continue;
      const engine::Epoch t = epoch + engine::from_seconds(row.t_s);
      const double error_m = (propagator->at(t).position.m - row.m).norm();
      csv << row.body << ',' << model << ',' << row.t_s << ',' << error_m << '\n';
      double& most = worst[row.body + ", " + model];
      most = std::max(most, error_m);
    }
  }
  csv.close();
  if (!csv) throw std::runtime_error(path + ": cannot be written");
  return worst;
}

}  // namespace

int compare_orbits(const CommonOptions& options, const OrbitsOptions& orbits) {
  const Scenario scenario = load_scenario(options);
  const engine::Epoch epoch = scenario.scene.epoch;
  const double last_s = engine::seconds(scenario.search_span);
  for (const engine::OrbitSpec* orbit : {&scenario.camera_orbit, &scenario.target_orbit})
    engine::need_span(*orbit, {epoch, epoch + scenario.search_span});
  const std::vector<Body> bodies = bodies_of(scenario);
  const bool to_itself = orbits.reference.empty();
  const std::vector<ReferenceRow> rows =
      to_itself ? own_rows(bodies, epoch, last_s) : read_reference(orbits.reference, last_s);
  fs::create_directories(orbits.out);
  const std::string csv = (fs::path(orbits.out) / "orbits.csv").string();
  const Worst worst = write_rows(csv, bodies, epoch, rows, to_itself);
  const bool drawn = run_plot_script("orbits.py", csv);
  if (options.quiet) return kGood;
  std::printf("%s: places of %zu rows against %s\n", csv.c_str(), rows.size(),
              to_itself ? "the scenario's own models" : orbits.reference.c_str());
  for (const auto& [name, most_m] : worst)
    std::printf("%s: %.3g m off at most\n", name.c_str(), most_m);
  if (!drawn) std::printf("no picture: /usr/bin/python3 with matplotlib did not draw it\n");
  return kGood;
}

}  // namespace starloop
