#include "hil/faults/fault_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>

#include "engine/core/crc32c.h"

namespace hil {

using engine::at_least;
using engine::between;
using engine::ConfigTable;
using engine::from_seconds;

namespace {

constexpr std::array<const char*, kFaultKinds> kNames = {"away",
                                                         "dropped",
                                                         "late",
                                                         "slow",
                                                         "duplicated",
                                                         "frozen",
                                                         "rays",
                                                         "blooming",
                                                         "hot_column",
                                                         "stuck_column",
                                                         "torn",
                                                         "flipped",
                                                         "clock",
                                                         "command_lost",
                                                         "command_corrupted",
                                                         "command_delayed",
                                                         "command_duplicated"};
constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
constexpr double kLongest_s = 1e8;
constexpr double kLargestFrame = 9e15;
constexpr int kMostColumns = 64;

FaultWindow read_window(const ConfigTable& table) {
  FaultWindow window;
  window.probability = table.number_or("probability", 1.0, between(0.0, 1.0));
  window.from = from_seconds(table.number_or("from_s", 0.0, between(0.0, kLongest_s)));
  if (table.has("to_s")) window.to = from_seconds(table.number("to_s", between(0.0, kLongest_s)));
  const auto frame = between(0.0, kLargestFrame);
  window.from_frame = static_cast<std::uint64_t>(table.integer_or("from_frame", 0, frame));
  if (table.has("to_frame"))
    window.to_frame = static_cast<std::uint64_t>(table.integer("to_frame", frame));
  if (window.to <= window.from) table.fail("to_s", "must be after from_s");
  if (window.to_frame <= window.from_frame) table.fail("to_frame", "must be after from_frame");
  return window;
}

void read_columns(const ConfigTable& table, std::uint64_t seed, int width_px, int bits,
                  PlannedFault& fault) {
  const int full_scale = (1 << bits) - 1;
  const bool hot = fault.kind == FaultKind::kHotColumn;
  const auto dn = between(hot ? 1.0 : 0.0, full_scale);
  fault.dn = static_cast<int>(hot ? table.integer("dn", dn) : table.integer_or("dn", 0, dn));
  const int most = std::min(kMostColumns, width_px);
  const int count = static_cast<int>(table.integer_or("columns", 1, between(1.0, most)));
  if (table.has("column")) {
    const int first = static_cast<int>(table.integer("column", between(0.0, width_px - count)));
    for (int i = 0; i < count; ++i) fault.columns.push_back(first + i);
    return;
  }
  // Frame 2^64 - 1 is none that a run reaches: these draws are nobody else's.
  engine::Draws draws = fault.draws(seed, std::numeric_limits<std::uint64_t>::max());
  std::set<int> columns;
  while (static_cast<int>(columns.size()) < count)
    columns.insert(static_cast<int>(draws.uniform_double() * width_px));
  fault.columns.assign(columns.begin(), columns.end());
}

void read_parameters(const ConfigTable& table, std::uint64_t seed, int width_px, int bits,
                     PlannedFault& fault) {
  switch (fault.kind) {
    case FaultKind::kLate:
      fault.frames = static_cast<int>(table.integer_or("frames", 1, between(1.0, kMostFramesLate)));
      break;
    case FaultKind::kSlow:
      fault.slow_by = from_seconds(table.number("ms", between(1e-3, 1e5)) * 1e-3);
      break;
    case FaultKind::kRays:
      fault.tracks = table.number_or("tracks", fault.tracks, between(1e-6, 100.0));
      fault.length_px = table.number_or("length_px", fault.length_px, between(0.0, 1e4));
      fault.dn_per_px = table.number_or("dn_per_px", fault.dn_per_px, between(1.0, 1e6));
      break;
    case FaultKind::kBlooming:
      fault.bleed = table.number_or("bleed", fault.bleed, between(0.01, 1e4));
      break;
    case FaultKind::kHotColumn:
    case FaultKind::kStuckColumn:
      read_columns(table, seed, width_px, bits, fault);
      break;
    case FaultKind::kFlipped:
      fault.bit_error_rate = table.number("bit_error_rate", between(1e-15, 0.5));
      break;
    case FaultKind::kClock:
      fault.ppm = table.number_or("ppm", 0.0, between(-1e5, 1e5));
      fault.jump = from_seconds(table.number_or("jump_ms", 0.0, between(-1e9, 1e9)) * 1e-3);
      break;
    case FaultKind::kCommandCorrupted:
      fault.bits = static_cast<int>(table.integer_or("bits", 1, between(1.0, 64.0)));
      break;
    case FaultKind::kCommandDelayed:
      fault.commands =
          static_cast<int>(table.integer_or("commands", 1, between(1.0, kMostCommandsDelayed)));
      break;
    default:
      break;
  }
}

FaultKind read_kind(const ConfigTable& table, const std::string& name) {
  ConfigTable::Choices<FaultKind> choices;
  for (int i = 0; i < kFaultKinds; ++i)
    choices.emplace_back(kNames[static_cast<std::size_t>(i)], static_cast<FaultKind>(i));
  return table.choice_or<FaultKind>("kind", name, choices);
}

}  // namespace

const char* fault_kind_name(FaultKind kind) noexcept {
  return kNames[static_cast<std::size_t>(kind)];
}

FaultSpec read_faults(const engine::ConfigReader& config, std::uint64_t seed, int width_px,
                      int bits) {
  FaultSpec spec;
  spec.seed = seed;
  std::set<std::uint32_t> places;
  for (const std::string& name : config.tables_below("faults")) {
    if (name.find_first_not_of(kLetters) != std::string::npos)
      throw engine::ConfigError(config.name() +
                                ": a table below faults must be named with letters, "
                                "digits, _ and -, got \"" +
                                name + "\"");
    const ConfigTable table = config.table("faults." + name);
    PlannedFault fault;
    fault.name = name;
    fault.kind = read_kind(table, name);
    fault.window = read_window(table);
    fault.place = engine::crc32c(std::as_bytes(std::span(name)));
    if (!places.insert(fault.place).second)
      table.fail("kind", "belongs to a name with another's checksum: choose another name");
    read_parameters(table, seed, width_px, bits, fault);
    spec.faults.push_back(std::move(fault));
  }
  std::stable_sort(spec.faults.begin(), spec.faults.end(),
                   [](const auto& a, const auto& b) { return a.kind < b.kind; });
  return spec;
}

}  // namespace hil
