#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/selftest/corner.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

using corners::Corner;
using corners::Room;

/// What of the table failed.
struct Tally {
  int rows = 0;
  int missed = 0;
  int silent = 0;  ///< rows whose plain method keeps the bound, too
  void add(const Corner& c) noexcept {
    ++rows;
    missed += c.met() ? 0 : 1;
    silent += c.shows() ? 0 : 1;
  }
};

std::vector<Room> measured(double bounds) {
  std::vector<Room> rooms = corners::all_corners();
  for (Room& room : rooms)
    for (Corner& c : room.corners) c.bound *= bounds;
  return rooms;
}

void print_wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 100;
  std::size_t at = 0;
  while (at < text.size()) {
    std::size_t end = text.size();
    if (end - at > kWidth) {
      end = text.rfind(' ', at + kWidth);
      if (end == std::string::npos || end <= at) end = at + kWidth;
    }
    std::printf("      %s\n", text.substr(at, end - at).c_str());
    at = end + (end < text.size() && text[end] == ' ' ? 1U : 0U);
  }
}

/// Without the sign that a nan may have.
std::string text_of(double x) {
  char text[32] = "nan";
  if (x == x) std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

void print_row(const Corner& c, bool explain) {
  std::printf("  %-33s  %-27s  %9s  %9s  %7.2g  %-7s %s\n", c.regime.c_str(), c.plain.c_str(),
              text_of(c.plain_error).c_str(), text_of(c.our_error).c_str(), c.bound, c.unit.c_str(),
              c.met() ? "ok" : "NOT");
  if (explain) print_wrapped(c.why);
}

Tally print_table(const std::vector<Room>& rooms, bool explain) {
  Tally tally;
  std::printf("  %-33s  %-27s  %9s  %9s  %7s  %-7s\n", "where methods fail", "the plain method",
              "its error", "ours", "bound", "unit");
  for (const Room& room : rooms) {
    std::printf("%s\n", room.name.c_str());
    for (const Corner& c : room.corners) {
      print_row(c, explain);
      tally.add(c);
    }
  }
  return tally;
}

/// What is no number, and what has no end, as a word: JSON has neither.
nlohmann::ordered_json number(double x) {
  if (x != x) return "nan";
  if (x - x != 0.0) return "inf";
  return x;
}

Tally print_json(const std::vector<Room>& rooms) {
  Tally tally;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Room& room : rooms) {
    for (const Corner& c : room.corners) {
      list.push_back({{"part", room.name},
                      {"regime", c.regime},
                      {"plain_method", c.plain},
                      {"plain_error", number(c.plain_error)},
                      {"error", number(c.our_error)},
                      {"bound", number(c.bound)},
                      {"unit", c.unit},
                      {"why", c.why},
                      {"plain_method_fails", c.shows()},
                      {"ok", c.met()}});
      tally.add(c);
    }
  }
  std::printf("%s\n", list.dump(2).c_str());
  return tally;
}

}  // namespace

int test_corners(const SelftestOptions& options) {
  const std::vector<Room> rooms = measured(options.bounds);
  const Tally tally = options.as_json ? print_json(rooms) : print_table(rooms, options.explain);
  if (!options.as_json) {
    std::printf("%d of %d within their bound\n", tally.rows - tally.missed, tally.rows);
    if (tally.silent > 0)
      std::printf("%d rows show nothing: the plain method keeps the bound\n", tally.silent);
  }
  return tally.missed == 0 ? kGood : kCriterionFailed;
}

}  // namespace starloop
