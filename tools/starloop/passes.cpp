#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "engine/core/constants.h"
#include "tools/starloop/orbit_notes.h"
#include "tools/starloop/pass_report.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::seconds;

/// A file that is complete or an error.
template <class Write>
void write_file(const fs::path& path, const Write& write) {
  std::ofstream file(path);
  write(file);
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void print_table(const PassReport& report) {
  std::printf("%4s  %-23s %-12s %-12s %13s %13s %13s %9s %9s %15s %8s %6s %6s %-8s  %s\n", "pass",
              "AOS, UTC", "TCA", "LOS", "AOS, s", "TCA, s", "LOS, s", "lasts, s", "range, km",
              "at AOS, LOS, km/s", "mrad/s", "phase", "Earth", "light", "limited by");
  std::size_t number = 0;
  for (const PassFacts& facts : report.passes()) {
    const engine::Pass& p = facts.pass;
    const std::string closest = report.utc(p.closest);
    const std::string end = report.utc(p.end);
    const std::size_t clock = closest.find('T') + 1;
    std::printf(
        "%4zu  %-23s %-12s %-12s %13.3f %13.3f %13.3f %9.3f %9.3f %8.3f %+8.3f %8.2f %6.1f %5.1f%% "
        "%-8s  %s, %s%s\n",
        ++number, report.utc(p.start).c_str(), closest.c_str() + clock, end.c_str() + clock,
        seconds(p.start), seconds(p.closest), seconds(p.end), seconds(p.end - p.start),
        p.min_range_m * 1e-3, facts.start_range_rate_m_s * 1e-3, facts.end_range_rate_m_s * 1e-3,
        facts.largest_rate_rad_s * 1e3, facts.phase_angle_rad / engine::kDegree,
        facts.earth_behind_share * 100.0, facts.least_lit < 1.0 ? "penumbra" : "sunlit",
        name_of(p.start_limited_by).data(), name_of(p.end_limited_by).data(),
        p.truncated() ? " (truncated)" : "");
  }
}

/// All files of --out. Returns whether the pictures were drawn.
bool write_folder(PassReport& report, const fs::path& folder, std::size_t number) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": " + error.message());
  write_file(folder / "passes.csv", [&](std::ostream& csv) { report.write_csv(csv); });
  write_file(folder / "passes.json",
             [&](std::ostream& json) { json << report.json().dump(2) << '\n'; });
  write_file(folder / "conditions.csv", [&](std::ostream& csv) { report.write_conditions(csv); });
  if (number == 0) return run_plot_script("passes.py", folder);
  const std::string curves = "pass_" + std::to_string(number) + ".csv";
  write_file(folder / curves, [&](std::ostream& csv) { report.write_curves(csv, number); });
  return run_plot_script("passes.py", folder, std::to_string(number));
}

/// The pass that is looked at closely; 0 when there are none.
std::size_t chosen_number(const PassReport& report, const Scenario& scenario, std::size_t asked) {
  const std::size_t count = report.passes().size();
  if (asked > count)
    throw engine::ConfigError("--pass must be one of the " + std::to_string(count) +
                              " passes that these orbits have, got " + std::to_string(asked));
  return asked > 0 ? asked : std::min(scenario.run.pass, count);
}

/// Of the pass that is looked at.
void print_notes(const Scenario& scenario, const PassReport& report, std::size_t number) {
  const engine::SimTime when =
      number == 0 ? engine::SimTime{} : report.passes()[number - 1].pass.closest;
  for (const std::string& note : orbit_notes(scenario, when)) std::printf("%s\n", note.c_str());
  if (const std::string note = leap_second_note(scenario); !note.empty())
    std::fprintf(stderr, "%s\n", note.c_str());
}

}  // namespace

int list_passes(const CommonOptions& options, const PassesOptions& passes) {
  Scenario scenario = load_scenario(options);
  scenario.run.pattern = true;  // no renderer is wanted, only where things are
  const Rig rig(scenario, 1);
  PassReport report(scenario, rig);
  const std::size_t number = chosen_number(report, scenario, passes.number);
  if (!passes.csv.empty())
    write_file(passes.csv, [&](std::ostream& csv) { report.write_csv(csv); });
  const bool drawn = passes.out.empty() || write_folder(report, passes.out, number);
  if (passes.as_json) {
    std::printf("%s\n", report.json().dump(2).c_str());
    return kGood;
  }
  if (!options.quiet) {
    std::printf("%zu passes in %.6g days from %s UTC, closer than %.6g km, target lit:\n",
                report.passes().size(), seconds(scenario.search_span) / 86400.0,
                report.utc(engine::SimTime{}).c_str(), scenario.visibility.max_range_m * 1e-3);
  }
  print_table(report);
  if (options.quiet) return kGood;
  std::printf(
      "AOS, TCA, LOS: begin, closest approach, end. Range: least. mrad/s: how fast the "
      "line of sight turns at most.\nPhase: angle at the target between Sun and camera, deg, "
      "at TCA. Earth: how long it is behind the target.\n");
  if (!passes.out.empty()) std::printf("%s: tables and pictures\n", passes.out.c_str());
  if (!drawn) std::printf("no picture: /usr/bin/python3 with matplotlib did not draw it\n");
  print_notes(scenario, report, number);
  return kGood;
}

}  // namespace starloop
