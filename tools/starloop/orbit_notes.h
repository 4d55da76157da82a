#pragma once

#include <string>
#include <vector>

#include "tools/starloop/scenario.h"

namespace starloop {

/// A line for each of camera and target: its model of motion, and what that model leaves out, at a
/// time and at the end of the search, in kilometres and in pixels across the line of sight. Between
/// the epoch and then; how good the elements are it cannot know.
[[nodiscard]] std::vector<std::string> orbit_notes(const Scenario& scenario, engine::SimTime when);

/// What to say when the scenario ends in a year that the table of leap seconds is too old to know;
/// empty otherwise.
[[nodiscard]] std::string leap_second_note(const Scenario& scenario);

}  // namespace starloop
