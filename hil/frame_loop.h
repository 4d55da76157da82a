#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <semaphore>
#include <stop_token>
#include <vector>

#include "engine/scene_generator.h"
#include "hil/clock.h"
#include "hil/command_gate.h"
#include "hil/hiccup_meter.h"
#include "hil/loop_report.h"
#include "hil/overload_governor.h"
#include "hil/pointing_source.h"
#include "hil/spsc_ring.h"
#include "hil/trigger.h"

namespace hil {

/// When the link still holds every slot: the rig must keep time, a rehearsal must keep every frame.
enum class WhenBusy : std::uint8_t { kDropFrame, kWait };

struct Decisions;

struct LoopSpec {
  engine::SimTime start{};
  engine::Duration period{100'000'000};
  std::uint64_t frames = 1;
  engine::Duration exposure{1'000'000};
  /// Commands that are in by this long before a shutter opens (or by when a late loop gets there)
  /// are obeyed from then on and show in that frame: the latency is one frame. Later ones wait for
  /// the next slot.
  engine::Duration command_lead{20'000'000};
  WhenBusy when_busy = WhenBusy::kDropFrame;
  /// Lockstep: the next frame waits this long for the answer to the last. Zero: it does not wait.
  engine::Duration answer_timeout{};
  engine::Duration send_timeout{50'000'000};
  /// If given, each frame waits this long for a pull; without one the run ends.
  Trigger* trigger = nullptr;
  engine::Duration trigger_timeout{};
  /// Rendering stops with what it has once it has taken this long, and the record says after how
  /// many passes. Zero: it is finished. One of two things in a frame that a clock decides.
  engine::Duration render_time{};
  /// A frame that took too long makes the next ones leave something out, as OverloadGovernor has
  /// it. The other thing that a clock decides.
  bool sheds = false;
  HiccupMeter* hiccups = nullptr;  ///< if given, says which delays are the machine's
  bool open_loop = false;          ///< commands count as reports: nothing of them is obeyed
  int service_priority = 0;        ///< SCHED_FIFO of sender and receiver; 0: ordinary
  /// A replay: which frames are skipped, dropped and exposed, and which commands are obeyed when,
  /// is what these say; neither the clock nor the link nor a command source decides. Outlives the
  /// loop.
  const Decisions* replay = nullptr;
  int width_px = 1024;
  int height_px = 1024;
  int bits = 11;
};

/// Keeps time: one frame a period, through the generator to the sink, commands back into the
/// pointing. Absolute deadlines; a period that is over is skipped and counted, never caught up.
///
/// Thread: run() is the loop; it starts a sender and a receiver. Observers pop `frames()` and
/// `commands()` from one thread of their own.
class FrameLoop {
 public:
  using FrameRing = SpscRing<FrameRecord, 256>;
  using CommandRing = SpscRing<CommandRecord, 1024>;

  /// Allocates everything the loop will ever need. May throw.
  FrameLoop(const LoopSpec& spec, Clock& clock, PointingSource& pointing,
            engine::SceneGenerator& generator, FrameSink& sink, CommandSource& commands);

  LoopReport run(const std::stop_token& stop);

  [[nodiscard]] FrameRing& frames() noexcept { return frames_; }
  [[nodiscard]] CommandRing& commands() noexcept { return applied_; }

 private:
  static constexpr std::size_t kSlots = 4;
  struct Slot {
    Frame frame;
    engine::DnImage pixels;
    engine::TruthMask mask;
  };

  [[nodiscard]] engine::SimTime opening(std::uint64_t k) const noexcept {
    return spec_.start + spec_.period * static_cast<std::int64_t>(k);
  }
  /// Runs frame `k`; false: the run is over before its time.
  [[nodiscard]] bool run_frame(std::uint64_t k, const std::stop_token& stop, LoopReport& report);
  [[nodiscard]] bool wait_for_trigger(const std::stop_token& stop, LoopReport& report) noexcept;
  /// Sleeps until the shutter opens, and finds out why it opens late when it does. `delay` has what
  /// is known before.
  void wait_for_shutter(Delay delay, FrameRecord& record, LoopReport& report) noexcept;
  [[nodiscard]] engine::Duration held_up(engine::Duration from, engine::Duration to) noexcept;
  [[nodiscard]] std::uint64_t skip_missed(std::uint64_t k, LoopReport& report) noexcept;
  /// The same in a replay.
  [[nodiscard]] std::uint64_t next_due(std::uint64_t k) noexcept;
  [[nodiscard]] bool acquire_slot(const std::stop_token& stop, std::size_t& slot) noexcept;
  void obey(std::uint64_t k, LoopReport& report) noexcept;
  void expose(std::uint64_t k, std::size_t slot, FrameRecord& record) noexcept;
  /// False: it did not come in time, or the loop is to stop.
  [[nodiscard]] bool wait_for_answer(std::uint64_t k, const std::stop_token& stop,
                                     LoopReport& report) noexcept;
  void take_command(const Command& command, std::uint64_t k, LoopReport& report) noexcept;
  void send_frames(const std::stop_token& stop) noexcept;
  void receive_commands(const std::stop_token& stop) noexcept;
  void take_received(Command command) noexcept;

  LoopSpec spec_;
  Clock& clock_;
  PointingSource& pointing_;
  engine::SceneGenerator& generator_;
  FrameSink& sink_;
  CommandSource& source_;
  std::vector<Slot> slots_;

  SpscRing<std::size_t, kSlots> ready_;  // loop -> sender
  SpscRing<std::size_t, kSlots> free_;   // sender -> loop
  SpscRing<Command, 256> received_;      // receiver -> loop
  std::counting_semaphore<> ready_count_{0};
  std::counting_semaphore<> free_count_{0};
  std::counting_semaphore<> received_count_{0};

  std::vector<Command> waiting_;  // taken, not yet obeyed; the loop's own
  std::size_t next_due_ = 0;      // of a replay's decisions
  std::size_t next_command_ = 0;  // of a replay's decisions
  std::uint64_t skipped_before_ = 0;
  OverloadGovernor governor_;
  LoopCounts counts_;
  HiccupHistory hiccups_;
  std::optional<RunTimeMeter> run_time_;  // of the thread in run()
  LoopReport sender_counts_;              // the sender's own until it is joined
  LoopReport receiver_counts_;            // the receiver's own until it is joined
  CommandGate gate_;                      // the receiver's own until it is joined
  std::array<std::atomic<std::uint64_t>, kRefusals> refused_now_{};  // receiver -> loop
  FrameRing frames_;                                                 // loop -> observer
  CommandRing applied_;                                              // loop -> observer
};

}  // namespace hil
