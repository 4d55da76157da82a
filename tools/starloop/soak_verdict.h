#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "hil/hiccup_meter.h"
#include "hil/loop_report.h"

namespace starloop {

/// One flight of a soak, and what the process held when it was over.
struct SoakRound {
  bool slow_reader = false;
  bool in_realtime = true;
  hil::LoopReport loop;
  std::vector<double> late_s;  ///< of each frame's shutter
  hil::WakeHistogram machine;  ///< its own stalls
  bool audited = false;        ///< the reader was ours: the next four say what it got
  std::uint64_t read = 0;
  std::uint64_t torn = 0;
  std::uint64_t out_of_order = 0;
  std::uint64_t logged = 0;  ///< frames in record.slog, read back
  std::string log_fault;     ///< what is wrong with record.slog; empty: nothing
  std::uint64_t records_lost = 0;
  std::uint64_t not_finite = 0;  ///< rays that were refused, truths that are no numbers
  std::uint64_t heap_bytes = 0;  ///< in use
  std::uint64_t resident_bytes = 0;
  int descriptors = 0;
  int threads = 0;
};

struct SoakCheck {
  std::string name;
  bool good = true;
  std::string sentence;  ///< what was found, and what it had to be
};

/// Rounds before memory is judged: libraries fill their pools in the first ones.
inline constexpr std::size_t kWarmUpRounds = 2;

/// What a soak must show, over `hours` of it: every frame accounted for and read whole, logs that
/// can be read back, a cadence that is the machine's own or better, no late frame without a cause,
/// finite numbers, and nothing that grows. A frame's lateness is against absolute deadlines: a
/// clock that drifts shows in it.
[[nodiscard]] std::vector<SoakCheck> judge_soak(const std::vector<SoakRound>& rounds, double hours);

/// soak.json.
[[nodiscard]] nlohmann::ordered_json soak_json(const std::vector<SoakRound>& rounds,
                                               const std::vector<SoakCheck>& checks, double hours);

}  // namespace starloop
