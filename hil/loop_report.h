#pragma once

#include <array>
#include <cstdint>

#include "engine/scene_generator.h"
#include "hil/camera_link.h"
#include "hil/late_cause.h"

namespace hil {

/// What became of one due frame.
struct FrameRecord {
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  engine::Duration late{};                  ///< of the wake-up
  LateCause late_cause = LateCause::kNone;  ///< of a frame that is late or comes after skipped ones
  engine::Duration busy{};  ///< from the wake-up to the hand-over to the sender, by the clock
  engine::FrameReport report;
  TrimAngles trim_rad{};
  MeasuredAttitude measured;
  std::uint64_t skipped_before = 0;  ///< periods lost before this frame, because we were too slow
  int passes = 0;                    ///< of rendering, where a clock said when to stop; 0: none did
  engine::Shed shed = engine::Shed::kNothing;  ///< left out because time was short
  bool handed_over = false;                    ///< false: dropped, the link held every slot
};

/// A command, and the first frame it could show in. Together with the seed, all that a run depends
/// on.
struct CommandRecord {
  std::uint64_t frame = 0;
  Command command;
};

/// Counts that add up: due == sent + skipped + dropped + faults.
struct LoopReport {
  std::uint64_t due = 0;
  std::uint64_t sent = 0;
  std::uint64_t skipped = 0;  ///< whole periods that passed while we were still at work
  std::uint64_t dropped = 0;  ///< the link still held every slot
  std::uint64_t faults = 0;   ///< the link refused, timed out or was gone
  std::uint64_t late = 0;     ///< woken over a millisecond after the deadline
  /// Frames that were late or came after skipped ones, by cause.
  std::array<std::uint64_t, kLateCauses> late_by_cause{};
  /// Frames that were exposed, by what they left out because time was short.
  std::array<std::uint64_t, engine::kSheds> by_shed{};
  std::uint64_t commands = 0;        ///< obeyed
  std::uint64_t command_faults = 0;  ///< packets that were none
  RefusalCounts refused;             ///< commands that the gate turned away, by cause
  std::uint64_t commands_lost = 0;   ///< came faster than a slot could take them
  std::uint64_t records_lost = 0;    ///< the observer was too slow; the frame itself was not
  bool answer_missing = false;       ///< lockstep ended because no answer came
  bool trigger_missing = false;      ///< the run ended because nobody pulled the trigger
  engine::Error last_fault{};
};

}  // namespace hil
