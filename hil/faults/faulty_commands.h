#pragma once

#include <array>
#include <vector>

#include "hil/camera_link.h"
#include "hil/faults/fault_record.h"
#include "hil/faults/fault_spec.h"
#include "hil/faults/faulty_sink.h"

namespace hil {

/// Counts that add up: taken == delivered + lost + refused + held.
struct CommandFaultCounts {
  std::uint64_t taken = 0;  ///< from the real source
  std::uint64_t delivered = 0;
  std::uint64_t lost = 0;
  std::uint64_t refused = 0;  ///< corrupted, and the checksum saw it
  std::uint64_t held = 0;     ///< delayed to this moment
  std::uint64_t copies = 0;   ///< delivered besides
  std::uint64_t stand_ins = 0;
  std::uint64_t records_lost = 0;
};

/// A source whose commands go wrong as a scenario's faults say. One fault a command: of lost,
/// corrupted, delayed and duplicated the first that happens. Windows in seconds or frames mean the
/// last frame that FaultySink was given; before the first, the start of the run. Delays are counted
/// in commands, so that no clock decides.
///
/// In lockstep the loop waits for an answer to each frame. Where a fault keeps it away (the frame
/// never went out, or its answer is lost, refused or delayed) the loop is given an empty report in
/// its place, of a sender kStandIn of its own, and goes on; after the answer to a late frame that
/// went out instead. The software must answer every frame it gets, be it late; copies it need not.
///
/// Thread: receiver, but for the ring. Loop-safe.
class FaultyCommands final : public CommandSource {
 public:
  static constexpr std::uint32_t kStandIn = 0xFFFFFFFFU;

  enum class Pace : std::uint8_t { kRealtime, kLockstep };
  FaultyCommands(const FaultSpec& spec, CommandSource& inner, FrameNewsRing& news, Pace pace);

  engine::Expected<Command> receive(engine::Duration timeout) noexcept override;

  /// Thread: one observer.
  [[nodiscard]] FaultRing& records() noexcept { return records_; }
  /// After the run, as those of FaultySink.
  [[nodiscard]] const CommandFaultCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const std::vector<std::uint64_t>& happened() const noexcept { return happened_; }

 private:
  // More than can ever be due at once: all that is held, one command and its copy, and stand-ins
  // for it and for one look at the news.
  static constexpr std::size_t kMostReady = std::size_t{4} * kMostCommandsDelayed;
  struct Held {
    Command command;
    std::uint64_t due = 0;  ///< handed over just before this command
    bool used = false;
  };

  void read_news() noexcept;
  /// The last of an answer is in: what waited for it goes on.
  void note_answer(const Command& command) noexcept;
  void release_delayed() noexcept;
  /// The fault that happens to the command in hand; faults.size() when there is none.
  [[nodiscard]] std::size_t choose() const noexcept;
  /// False: refused by its checksum.
  [[nodiscard]] bool take(const Command& command) noexcept;
  void make_ready(const Command& command) noexcept;
  void stand_in_for(std::uint64_t frame) noexcept;
  void stand_in_for(const Command& command) noexcept;
  [[nodiscard]] engine::Expected<Command> corrupted(const Command& command,
                                                    std::size_t fault) const noexcept;
  void record(std::size_t fault, std::int64_t count) noexcept;

  FaultSpec spec_;
  CommandSource& inner_;
  FrameNewsRing& news_;
  Pace pace_;
  FaultMoment at_;
  std::uint64_t last_answered_ = FrameNews::kNothing;
  FrameNews waits_;           // withheld: its stand-in waits
  std::uint64_t number_ = 0;  // of the command in hand
  std::array<Held, kMostCommandsDelayed> held_;
  SpscRing<Command, kMostReady> ready_;  // within one thread: a queue
  CommandFaultCounts counts_;
  std::vector<std::uint64_t> happened_;
  FaultRing records_;  // receiver -> observer
};

}  // namespace hil
