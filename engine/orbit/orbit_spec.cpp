#include "engine/orbit/orbit_spec.h"

#include <algorithm>
#include <array>

#include "engine/orbit/j2.h"
#include "engine/orbit/kepler.h"

namespace engine {
namespace {

// Light's way, and how far ahead or behind guidance may believe a target to be.
constexpr Duration kBesideSpan = std::chrono::seconds(1100);

}  // namespace

std::string_view name_of(OrbitModel model) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"two-body", "j2", "ephemeris"};
  return kNames[static_cast<std::size_t>(model)];
}

OrbitSpec read_orbit(const ConfigTable& table) {
  OrbitSpec spec;
  spec.model = table.choice_or<OrbitModel>("propagator", "two-body",
                                           {{"two-body", OrbitModel::kTwoBody},
                                            {"j2", OrbitModel::kJ2},
                                            {"ephemeris", OrbitModel::kEphemeris}});
  const bool from_file = spec.model == OrbitModel::kEphemeris;
  spec.where = table.where(from_file ? "file" : "propagator");
  if (from_file) {
    const std::string path = table.text("file");
    try {
      spec.ephemeris.emplace(read_oem(KvnLines::from_file(path)));
    } catch (const ConfigError& e) {
      table.fail("file", std::string("is no ephemeris: ") + e.what());
    }
  } else if (table.has("file")) {
    table.fail("file", "needs propagator = \"ephemeris\"");
  }
  if (!from_file || table.has("semi_major_axis_km") || table.has("position_km"))
    spec.elements = read_elements(table);
  return spec;
}

void need_span(const OrbitSpec& spec, const EpochSpan& wanted) {
  if (spec.model == OrbitModel::kJ2 && wanted.end - wanted.begin > kLongestIntegration)
    throw ConfigError(spec.where + " \"j2\" is integrated for 1100 days at most, asked for until " +
                      utc_text(wanted.end) + " UTC");
  if (spec.model != OrbitModel::kEphemeris) return;
  if (const auto gap = spec.ephemeris->gap_in(wanted)) fail_for_gap(spec.where, wanted, *gap);
}

std::unique_ptr<const Propagator> make_propagator(const OrbitSpec& spec, Epoch epoch,
                                                  const EpochSpan& wanted) {
  if (spec.model == OrbitModel::kEphemeris)
    return std::make_unique<EphemerisPropagator>(*spec.ephemeris);
  if (spec.model == OrbitModel::kTwoBody)
    return std::make_unique<KeplerPropagator>(spec.elements, epoch);
  const EpochSpan span{std::min(wanted.begin, epoch) - kBesideSpan,
                       std::max(wanted.end, epoch) + kBesideSpan};
  return std::make_unique<J2Propagator>(KeplerPropagator(spec.elements, epoch).at(epoch), epoch,
                                        span);
}

}  // namespace engine
