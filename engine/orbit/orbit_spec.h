#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/orbit/elements.h"
#include "engine/orbit/ephemeris.h"

namespace engine {

/// The ladder of a body's motion, from the paper's to someone else's.
enum class OrbitModel : std::uint8_t {
  kTwoBody,    ///< a point mass: KeplerPropagator
  kJ2,         ///< an oblate Earth: J2Propagator
  kEphemeris,  ///< a CCSDS file: EphemerisPropagator
};
[[nodiscard]] std::string_view name_of(OrbitModel model) noexcept;

/// How a body moves, as its table of the scenario says.
struct OrbitSpec {
  OrbitModel model = OrbitModel::kTwoBody;
  KeplerElements elements;                       ///< at the epoch; of kEphemeris unused
  std::optional<EphemerisPropagator> ephemeris;  ///< of kEphemeris
  std::string where;                             ///< the place in the scenario that chooses
};

/// `propagator`, and the elements or state, or the `file` of an ephemeris, which is read. Elements
/// may stand beside a file, too. Throws ConfigError.
[[nodiscard]] OrbitSpec read_orbit(const ConfigTable& table);

/// Throws ConfigError when a file has nothing for a part of `wanted`, or an integration would be
/// longer than kLongestIntegration. No other model has an end.
void need_span(const OrbitSpec& spec, const EpochSpan& wanted);
inline constexpr Duration kLongestIntegration = std::chrono::hours(24 * 1100);

/// The body as it moves, in a scenario that begins at `epoch`. J2 is integrated over `wanted`,
/// and a bit to both sides for who aims ahead. Pre: need_span().
[[nodiscard]] std::unique_ptr<const Propagator> make_propagator(const OrbitSpec& spec, Epoch epoch,
                                                                const EpochSpan& wanted);

}  // namespace engine
