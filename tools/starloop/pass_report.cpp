#include "tools/starloop/pass_report.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "engine/core/constants.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/utc.h"

namespace starloop {
namespace {

using engine::Condition;
using engine::Pass;
using engine::seconds;
using engine::SimTime;
using engine::Window;

constexpr int kMomentsOfAPass = 400;

/// One row of the table by name, for both files.
std::vector<std::pair<std::string, nlohmann::ordered_json>> cells_of(const PassReport& report,
                                                                     const PassFacts& facts) {
  const Pass& p = facts.pass;
  return {{"start_utc", report.utc(p.start)},
          {"closest_utc", report.utc(p.closest)},
          {"end_utc", report.utc(p.end)},
          {"start_s", seconds(p.start)},
          {"closest_s", seconds(p.closest)},
          {"end_s", seconds(p.end)},
          {"duration_s", seconds(p.end - p.start)},
          {"min_range_km", p.min_range_m * 1e-3},
          {"start_range_rate_km_s", facts.start_range_rate_m_s * 1e-3},
          {"end_range_rate_km_s", facts.end_range_rate_m_s * 1e-3},
          {"max_line_of_sight_rate_mrad_s", facts.largest_rate_rad_s * 1e3},
          {"closest_phase_angle_deg", facts.phase_angle_rad / engine::kDegree},
          {"least_lit_fraction", facts.least_lit},
          {"earth_behind_share", facts.earth_behind_share},
          {"start_limited_by", name_of(p.start_limited_by)},
          {"end_limited_by", name_of(p.end_limited_by)},
          {"truncated", p.truncated()}};
}

std::string number_text(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string cell_text(const nlohmann::ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.is_boolean() ? value.dump() : number_text("%.12g", value.get<double>());
}

void write_windows(std::ostream& csv, std::string_view name, const std::vector<Window>& windows) {
  for (const Window& w : windows)
    csv << name << ',' << number_text("%.9f", seconds(w.start)) << ','
        << number_text("%.9f", seconds(w.end)) << '\n';
}

}  // namespace

PassReport::PassReport(const Scenario& scenario, const Rig& rig)
    : scenario_(scenario),
      camera_(rig.camera()),
      target_(rig.target()),
      sun_(scenario.visibility.sun) {
  for (const Pass& pass : passes_of(scenario)) passes_.push_back(facts_of(pass));
}

std::string PassReport::utc(SimTime t) const {
  return engine::utc_text(scenario_.scene.epoch + t.time_since_epoch());
}

PassMoment PassReport::at(SimTime t) {
  const engine::Epoch now = scenario_.scene.epoch + t.time_since_epoch();
  const engine::SightLine line = sight_line(camera_, target_, now, engine::LightPath::kGeometric);
  const engine::Position<engine::J2000> sun = sun_.at(now);
  PassMoment moment;
  moment.t = t;
  moment.range_m = line.range_m;
  moment.range_rate_m_s = line.range_rate_m_s;
  moment.rate_rad_s = line.rate_rad_s;
  moment.phase_angle_rad =
      engine::angle_between_rad(sun.m - line.target.position.m, -line.toward_target.unit);
  moment.lit = lit_fraction(scenario_.visibility.shadow, line.target.position, sun);
  moment.earth_behind = earth_is_behind(line.camera.position, line.target.position);
  return moment;
}

std::vector<Window> PassReport::windows(engine::Conditions conditions, SimTime begin,
                                        SimTime end) const {
  return find_windows(camera_, target_, scenario_.visibility, conditions, scenario_.scene.epoch,
                      begin, end);
}

PassFacts PassReport::facts_of(const Pass& pass) {
  PassFacts facts;
  facts.pass = pass;
  facts.start_range_rate_m_s = at(pass.start).range_rate_m_s;
  facts.end_range_rate_m_s = at(pass.end).range_rate_m_s;
  facts.phase_angle_rad = at(pass.closest).phase_angle_rad;
  const auto take = [&facts](const PassMoment& moment) {
    facts.largest_rate_rad_s = std::max(facts.largest_rate_rad_s, moment.rate_rad_s);
    facts.least_lit = std::min(facts.least_lit, moment.lit);
  };
  take(at(pass.closest));
  constexpr int kSteps = 50;
  for (int i = 0; i <= kSteps; ++i) take(at(pass.start + (pass.end - pass.start) / kSteps * i));
  take(at(pass.end));
  engine::Duration behind{};
  for (const Window& w : windows({Condition::kEarthBehind}, pass.start, pass.end))
    behind += w.end - w.start;
  const double length_s = seconds(pass.end - pass.start);
  facts.earth_behind_share = length_s > 0.0 ? seconds(behind) / length_s : 0.0;
  return facts;
}

nlohmann::ordered_json PassReport::json() const {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const PassFacts& facts : passes_) {
    nlohmann::ordered_json object;
    for (auto& [name, value] : cells_of(*this, facts)) object[name] = std::move(value);
    list.push_back(std::move(object));
  }
  return list;
}

void PassReport::write_csv(std::ostream& csv) const {
  csv << "pass";
  // An empty table has its header, too.
  for (const auto& [name, value] : cells_of(*this, {})) csv << ',' << name;
  csv << '\n';
  for (std::size_t i = 0; i < passes_.size(); ++i) {
    csv << i + 1;
    for (const auto& [name, value] : cells_of(*this, passes_[i])) csv << ',' << cell_text(value);
    csv << '\n';
  }
}

void PassReport::write_conditions(std::ostream& csv) const {
  const SimTime end{scenario_.search_span};
  const auto needed = engine::Conditions::needed(scenario_.visibility);
  csv << "condition,start_s,end_s\n";
  write_windows(csv, "span", {{SimTime{}, end}});
  for (const Condition c : {Condition::kRange, Condition::kLineOfSight, Condition::kEclipse,
                            Condition::kSunExclusion, Condition::kField, Condition::kSignal})
    if (needed.has(c)) write_windows(csv, name_of(c), windows({c}, SimTime{}, end));
  std::vector<Window> all;
  for (const PassFacts& facts : passes_) all.push_back(facts.pass);
  write_windows(csv, "all", all);
  // Of the passes only: elsewhere nobody looks.
  for (const Window& pass : all)
    write_windows(csv, name_of(Condition::kEarthBehind),
                  windows({Condition::kEarthBehind}, pass.start, pass.end));
}

void PassReport::write_curves(std::ostream& csv, std::size_t number) {
  const Pass& pass = passes_.at(number - 1).pass;
  csv << "time_s,range_km,range_rate_km_s,line_of_sight_rate_mrad_s,phase_angle_deg,lit_fraction,"
         "earth_behind\n";
  std::vector<SimTime> times{pass.closest};
  for (int i = 0; i <= kMomentsOfAPass; ++i)
    times.push_back(pass.start + (pass.end - pass.start) / kMomentsOfAPass * i);
  std::sort(times.begin(), times.end());
  for (const SimTime t : times) {
    const PassMoment m = at(t);
    csv << number_text("%.9f", seconds(t)) << ',' << number_text("%.9g", m.range_m * 1e-3) << ','
        << number_text("%.9g", m.range_rate_m_s * 1e-3) << ','
        << number_text("%.9g", m.rate_rad_s * 1e3) << ','
        << number_text("%.9g", m.phase_angle_rad / engine::kDegree) << ','
        << number_text("%.6f", m.lit) << ',' << (m.earth_behind ? 1 : 0) << '\n';
  }
}

}  // namespace starloop
