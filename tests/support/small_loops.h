#pragma once

#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "hil/frame_loop.h"
#include "hil/no_commands.h"
#include "tests/support/fakes.h"

/// Loops of a few pixels, and what is said of them.
namespace small_loops {

using engine::Duration;
using hil::Command;
using hil::CommandKind;
using hil::CommandRecord;
using hil::Frame;
using hil::FrameLoop;
using hil::FrameRecord;
using hil::LoopReport;
using hil::LoopSpec;

inline constexpr Duration kPeriod{100'000'000};
inline constexpr Duration kMillisecond{1'000'000};
inline const engine::SimTime kStart = engine::sim_time(1000.0);

inline LoopSpec small_loop(std::uint64_t frames) {
  LoopSpec spec;
  spec.start = kStart;
  spec.period = kPeriod;
  spec.frames = frames;
  spec.width_px = 8;
  spec.height_px = 2;
  return spec;
}

/// Rehearsals keep every frame, so that counts do not depend on how threads are scheduled.
inline LoopSpec patient_loop(std::uint64_t frames) {
  LoopSpec spec = small_loop(frames);
  spec.when_busy = hil::WhenBusy::kWait;
  return spec;
}

inline LoopSpec lockstep_loop(std::uint64_t frames) {
  LoopSpec spec = patient_loop(frames);
  // Only a loop that is wrong waits this long.
  spec.answer_timeout = std::chrono::seconds(20);
  spec.send_timeout = std::chrono::seconds(20);
  return spec;
}

inline engine::SimTime opening(std::uint64_t k) {
  return kStart + kPeriod * static_cast<std::int64_t>(k);
}

inline void expect_adds_up(const LoopReport& report) {
  EXPECT_EQ(report.due, report.sent + report.skipped + report.dropped + report.faults);
}

template <class Ring>
auto drain(Ring& ring) {
  using Record =
      std::conditional_t<std::is_same_v<Ring, FrameLoop::FrameRing>, FrameRecord, CommandRecord>;
  std::vector<Record> records;
  for (Record record; ring.pop(record);) records.push_back(record);
  return records;
}

inline Command trim_answer(const Frame& frame, double trim_rad = 0.0) {
  Command command;
  command.sequence = frame.sequence;
  command.answers_frame = frame.sequence;
  command.kind = CommandKind::kTrim;
  command.trim_offset_rad = {trim_rad, 0.0};
  command.reference = frame.shutter_open;
  return command;
}

/// A loop with everything around it faked.
struct Rig {
  hil::ManualClock clock{kStart - kPeriod};
  fakes::IdealPointing pointing;
  fakes::Sink sink;
  hil::NoCommands silent;
};

}  // namespace small_loops
