#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/random.h"
#include "engine/core/time.h"

namespace hil {

/// What can be made to go wrong, in the order in which a frame passes it. Tables of a scenario are
/// called `faults.<any name>`; `kind` is one of the words below, and the name itself when left out:
///
///     [faults.dropped]            # drops one frame in a hundred
///     probability = 0.01
///     [faults.eclipse_reset]      # and the link is away for two seconds
///     kind = "away"
///     from_s = 10.0
///     to_s = 12.0
///
/// Kind and keys, beside those of FaultWindow:
///   on the wire    away: send says kDisconnected. dropped: lost on the way, the sender is not
///       told. late: sent just before the frame that comes `frames` (1) later. slow: the link takes
///       `ms` more; without a clock, in lockstep, it does not happen. duplicated: sent once more,
///       just before the next frame.
///   in the pixels    frozen: they are those of the last frame that was not. rays: cosmic rays, on
///       average `tracks` (1) a frame, of a mean `length_px` (10) and a mean `dn_per_px` (200).
///       blooming: runs of n pixels at full scale in a column bleed `bleed` (2) n pixels up and
///       down. hot_column: `dn` more in `columns` (1) columns from `column` on; without `column`
///       they are drawn once, anywhere. stuck_column: `dn` (0) whatever the light. torn: from a
///       random row down those of the frame before. flipped: each bit is wrong at `bit_error_rate`.
///   in the header    clock: shutter times are off by `jump_ms` (0) and by `ppm` (0).
///   commands    command_lost. command_corrupted: `bits` (1) bits of the packet wrong, so that its
///       checksum refuses it. command_delayed: handed over just before the one that comes
///       `commands` (1) later; the loop's gate refuses one that a later one has overtaken, so it
///       counts as reordered unless all are delayed alike. command_duplicated: handed over twice,
///       and the second refused.
enum class FaultKind : std::uint8_t {
  kAway,
  kDropped,
  kLate,
  kSlow,
  kDuplicated,
  kFrozen,
  kRays,
  kBlooming,
  kHotColumn,
  kStuckColumn,
  kTorn,
  kFlipped,
  kClock,
  kCommandLost,
  kCommandCorrupted,
  kCommandDelayed,
  kCommandDuplicated,
};
inline constexpr int kFaultKinds = 17;
[[nodiscard]] const char* fault_kind_name(FaultKind kind) noexcept;
[[nodiscard]] constexpr bool is_command_fault(FaultKind kind) noexcept {
  return kind >= FaultKind::kCommandLost;
}

/// Where a run stands: by the true time lines, whatever faults make of them.
struct FaultMoment {
  std::uint64_t frame = 0;
  engine::Duration since_start{};  ///< from the run's first shutter opening to this frame's
};

/// When a fault may happen. Keys: from_s, to_s, from_frame, to_frame, all of which must hold, and
/// the probability (1) for each frame or command inside. The end itself lies outside.
struct FaultWindow {
  engine::Duration from{};
  engine::Duration to = engine::Duration::max();
  std::uint64_t from_frame = 0;
  std::uint64_t to_frame = std::numeric_limits<std::uint64_t>::max();
  double probability = 1;  ///< in [0, 1]

  [[nodiscard]] bool holds(const FaultMoment& at) const noexcept {
    return at.since_start >= from && at.since_start < to && at.frame >= from_frame &&
           at.frame < to_frame;
  }
};

/// One table. Fields below `window` count for the kinds that name them.
struct PlannedFault {
  std::string name;
  FaultKind kind = FaultKind::kDropped;
  FaultWindow window;
  int frames = 1;              ///< late
  engine::Duration slow_by{};  ///< slow
  double tracks = 1;           ///< rays: mean of a frame
  double length_px = 10;       ///< rays: mean
  double dn_per_px = 200;      ///< rays: mean
  double bleed = 2;            ///< blooming
  int dn = 0;                  ///< hot_column, stuck_column
  std::vector<int> columns;    ///< hot_column, stuck_column: which
  double bit_error_rate = 0;   ///< flipped, in (0, 1)
  double ppm = 0;              ///< clock: positive is fast
  engine::Duration jump{};     ///< clock
  int bits = 1;                ///< command_corrupted
  int commands = 1;            ///< command_delayed

  /// What this fault draws for frame or command `n`. By the table's name: a table more or less
  /// changes nobody else's faults.
  [[nodiscard]] engine::Draws draws(std::uint64_t seed, std::uint64_t n) const noexcept {
    return {seed, engine::Stream::kFaults, n, place};
  }
  std::uint32_t place = 0;  ///< of the name
};

struct FaultSpec {
  std::uint64_t seed = 0;
  std::vector<PlannedFault> faults;  ///< in the order of their kinds, then of their names
};

inline constexpr int kMostFramesLate = 32;
inline constexpr int kMostCommandsDelayed = 64;

/// All tables below `faults`. Throws ConfigError.
[[nodiscard]] FaultSpec read_faults(const engine::ConfigReader& config, std::uint64_t seed,
                                    int width_px, int bits);

}  // namespace hil
