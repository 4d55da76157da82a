#include "tools/starloop/orbit_notes.h"

#include <algorithm>
#include <cstdio>

#include "engine/orbit/model_error.h"
#include "engine/orbit/utc.h"

namespace starloop {
namespace {

engine::Duration whole_span(const Scenario& scenario) {
  return std::max(scenario.search_span, scenario.latest.time_since_epoch());
}

/// "1.56 km", "0.12 m": three digits, in what suits them.
std::string distance_text(double m) {
  char text[40];
  std::snprintf(text, sizeof text, m < 1e3 ? "%.3g m" : "%.4g km", m < 1e3 ? m : m * 1e-3);
  return text;
}

}  // namespace

std::vector<std::string> orbit_notes(const Scenario& scenario, engine::SimTime when) {
  const engine::Epoch epoch = scenario.scene.epoch;
  const engine::Epoch t = epoch + when.time_since_epoch();
  const engine::Epoch end = epoch + whole_span(scenario);
  const Eigen::Vector3d line_m = propagator_of(scenario, scenario.target_orbit)->at(t).position.m -
                                 propagator_of(scenario, scenario.camera_orbit)->at(t).position.m;
  const double pixel_m = line_m.norm() * scenario.scene.camera.ifov_rad();
  std::vector<std::string> notes;
  for (const auto& [name, orbit] :
       {std::pair{"camera", &scenario.camera_orbit}, std::pair{"target", &scenario.target_orbit}}) {
    const engine::ModelError error(*orbit, epoch, end);
    char text[300];
    std::snprintf(text, sizeof text,
                  "%s: %s motion, %s off at %.1f s, %.3g px across a line of %.1f km; %s at the "
                  "end: %s",
                  name, name_of(orbit->model).data(), distance_text(error.at_m(t)).c_str(),
                  engine::seconds(when),
                  error.across_m(t, engine::direction_of<engine::J2000>(line_m)) / pixel_m,
                  line_m.norm() * 1e-3, distance_text(error.at_m(end)).c_str(),
                  error.cause().data());
    notes.emplace_back(text);
  }
  return notes;
}

std::string leap_second_note(const Scenario& scenario) {
  const engine::Epoch end = scenario.scene.epoch + whole_span(scenario);
  if (!engine::utc_is_a_guess(end)) return {};
  return "the scenario ends at " + engine::utc_text(end, 0) +
         " UTC, as far as is known: this machine's table of leap seconds (liberfa) is too old to "
         "say";
}

}  // namespace starloop
