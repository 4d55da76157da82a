#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "engine/orbit/passes.h"
#include "engine/orbit/sun_track.h"
#include "tools/starloop/rig.h"

namespace starloop {

/// What one pass is like. All of light paths that are straight and take no time.
struct PassFacts {
  engine::Pass pass;
  double start_range_rate_m_s = 0;
  double end_range_rate_m_s = 0;
  double largest_rate_rad_s = 0;  ///< of the line of sight
  double phase_angle_rad = 0;     ///< at the closest approach
  double least_lit = 1;           ///< share of the Sun's disc, in [0, 1]
  double earth_behind_share = 0;  ///< of the pass, in [0, 1]
};

/// One instant of a pass.
struct PassMoment {
  engine::SimTime t;
  double range_m = 0;
  double range_rate_m_s = 0;
  double rate_rad_s = 0;
  double phase_angle_rad = 0;
  double lit = 1;
  bool earth_behind = false;
};

/// The passes of a scenario, and what there is to say about them.
class PassReport {
 public:
  PassReport(const Scenario& scenario, const Rig& rig);

  [[nodiscard]] const std::vector<PassFacts>& passes() const noexcept { return passes_; }
  [[nodiscard]] PassMoment at(engine::SimTime t);
  [[nodiscard]] std::string utc(engine::SimTime t) const;

  [[nodiscard]] nlohmann::ordered_json json() const;
  void write_csv(std::ostream& csv) const;
  /// When each condition is met by itself, and all of them: condition,start_s,end_s; "span" is the
  /// whole search.
  void write_conditions(std::ostream& csv) const;
  /// Pre: a number of one of them, from 1.
  void write_curves(std::ostream& csv, std::size_t number);

 private:
  [[nodiscard]] PassFacts facts_of(const engine::Pass& pass);
  [[nodiscard]] std::vector<engine::Window> windows(engine::Conditions conditions,
                                                    engine::SimTime begin,
                                                    engine::SimTime end) const;

  const Scenario& scenario_;
  const engine::Propagator& camera_;
  const engine::Propagator& target_;
  engine::SunTrack sun_;
  std::vector<PassFacts> passes_;
};

}  // namespace starloop
