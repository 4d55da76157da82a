#include "hil/frame_loop.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "hil/decisions.h"
#include "hil/realtime.h"
#include "hil/steady_clock.h"

namespace hil {

using engine::Duration;
using engine::SimTime;

namespace {

constexpr Duration kPatience{50'000'000};  // how often a waiting thread looks for the stop
constexpr Duration kLateLimit{1'000'000};
constexpr std::size_t kMostWaiting = 256;
constexpr std::size_t kRunsPerRow = 8;  // of a truth mask, on average

}  // namespace

FrameLoop::FrameLoop(const LoopSpec& spec, Clock& clock, PointingSource& pointing,
                     engine::SceneGenerator& generator, FrameSink& sink, CommandSource& commands)
    : spec_(spec),
      clock_(clock),
      pointing_(pointing),
      generator_(generator),
      sink_(sink),
      source_(commands),
      slots_(kSlots),
      governor_(spec.period) {
  ENSURE(spec.period > Duration{} && spec.exposure > Duration{});
  ENSURE(spec.exposure + spec.command_lead <= spec.period);
  waiting_.reserve(kMostWaiting);
  for (std::size_t i = 0; i < kSlots; ++i) {
    slots_[i].pixels.resize(spec.width_px, spec.height_px);
    slots_[i].mask = engine::TruthMask(kRunsPerRow * static_cast<std::size_t>(spec.height_px));
    ENSURE(free_.push(i));
  }
  free_count_.release(kSlots);
}

LoopReport FrameLoop::run(const std::stop_token& stop) {
  LoopReport report;
  run_time_.emplace();
  // In this order: where the system has no thread for the sender, the receiver ends by itself.
  std::jthread receiver([this](const std::stop_token& s) { receive_commands(s); });
  std::jthread sender([this](const std::stop_token& s) { send_frames(s); });
  for (std::uint64_t k = 0; k < spec_.frames && !stop.stop_requested(); ++k) {
    k = skip_missed(k, report);
    if (k >= spec_.frames || !run_frame(k, stop, report)) break;
  }
  sender.request_stop();
  ready_count_.release();
  sender.join();
  receiver.request_stop();
  receiver.join();
  obey(spec_.frames, report);  // the answer to the last frame: for the record
  report.sent = sender_counts_.sent;
  report.faults = sender_counts_.faults;
  report.last_fault = sender_counts_.last_fault;
  report.command_faults = receiver_counts_.command_faults;
  report.refused = gate_.refused();
  report.commands_lost += receiver_counts_.commands_lost;
  return report;
}

bool FrameLoop::run_frame(std::uint64_t k, const std::stop_token& stop, LoopReport& report) {
  if (spec_.trigger != nullptr && !wait_for_trigger(stop, report)) return false;
  ++report.due;
  Delay delay;
  delay.in_time = skipped_before_ == 0 && clock_.now() <= opening(k);
  delay.loop = run_time_->read();
  obey(k, report);
  FrameRecord record;
  record.sequence = k;
  record.shutter_open = opening(k);
  record.skipped_before = std::exchange(skipped_before_, 0);
  wait_for_shutter(delay, record, report);
  std::size_t slot = 0;
  record.handed_over = acquire_slot(stop, slot);
  counts_ = {report.skipped, report.dropped, report.late, report.commands, {}};
  for (std::size_t i = 0; i < kRefusals; ++i)
    counts_.refused.by_cause[i] = refused_now_[i].load(std::memory_order_relaxed);
  if (record.handed_over) {
    expose(k, slot, record);
    ++report.by_shed[static_cast<std::size_t>(record.shed)];
  } else {
    ++report.dropped;
  }
  if (!frames_.push(record)) ++report.records_lost;
  return !record.handed_over || spec_.answer_timeout <= Duration{} || spec_.replay != nullptr ||
         wait_for_answer(k, stop, report);
}

bool FrameLoop::wait_for_trigger(const std::stop_token& stop, LoopReport& report) noexcept {
  if (spec_.trigger->wait(spec_.trigger_timeout, stop)) return true;
  report.trigger_missing = !stop.stop_requested();
  return false;
}

void FrameLoop::wait_for_shutter(Delay delay, FrameRecord& record, LoopReport& report) noexcept {
  record.late = clock_.sleep_until(record.shutter_open);
  const Duration woke = SteadyClock::stopwatch();
  if (record.late > kLateLimit) ++report.late;
  delay.late = record.late + spec_.period * static_cast<std::int64_t>(record.skipped_before);
  // A loop that was at work lost its time anywhere since the frame before; one that slept, now.
  const Duration from = woke - delay.late - (delay.in_time ? Duration{} : spec_.period);
  delay.held_up = held_up(from, woke);
  if (delay.late > kLateLimit) {
    const std::optional<RunTime> now = run_time_->read();
    if (now && delay.loop)
      delay.loop = *now - *delay.loop;
    else
      delay.loop.reset();
    record.late_cause = late_cause(delay);
  }
  ++report.late_by_cause[static_cast<std::size_t>(record.late_cause)];
}

/// How long the machine kept the meter from waking between the two.
Duration FrameLoop::held_up(Duration from, Duration to) noexcept {
  if (spec_.hiccups == nullptr) return {};
  // What began a stall may end it for us before it does for the meter, which then tells too late.
  const Duration due = std::clamp(spec_.hiccups->due(), from, to);
  for (Hiccup h; spec_.hiccups->next(h);) hiccups_.add(h);
  return hiccups_.within(from, due) + (to - due);
}

/// The first frame from `k` on whose shutter can still open on time.
std::uint64_t FrameLoop::skip_missed(std::uint64_t k, LoopReport& report) noexcept {
  std::uint64_t periods = 0;
  if (spec_.replay != nullptr) {
    periods = next_due(k) - k;
  } else if (const Duration behind = clock_.now() - opening(k); behind > kLateLimit) {
    periods = static_cast<std::uint64_t>((behind + spec_.period - Duration(1)) / spec_.period);
  }
  const std::uint64_t skipped = std::min(periods, spec_.frames - k);
  report.due += skipped;
  report.skipped += skipped;
  skipped_before_ += skipped;
  return k + skipped;
}

std::uint64_t FrameLoop::next_due(std::uint64_t k) noexcept {
  const auto& due = spec_.replay->due;
  while (next_due_ < due.size() && due[next_due_].frame < k) ++next_due_;
  return next_due_ < due.size() ? due[next_due_].frame : spec_.frames;
}

void FrameLoop::take_command(const Command& command, std::uint64_t k, LoopReport& report) noexcept {
  pointing_.apply(command);
  ++report.commands;
  if (!applied_.push({k, command})) ++report.records_lost;
}

void FrameLoop::obey(std::uint64_t k, LoopReport& report) noexcept {
  const SimTime slot = opening(k) - spec_.command_lead;
  if (k < spec_.frames) {
    static_cast<void>(clock_.sleep_until(slot));
    // Up to here the commands before this slot hold.
    static_cast<void>(pointing_.attitude(slot));
  }
  if (spec_.replay != nullptr) {
    const auto& commands = spec_.replay->commands;
    const auto now = [&] { return k >= spec_.frames || commands[next_command_].frame <= k; };
    for (; next_command_ < commands.size() && now(); ++next_command_)
      take_command(commands[next_command_].command, k, report);
    return;
  }
  for (const Command& command : waiting_) take_command(command, k, report);
  waiting_.clear();
  for (Command command; received_.pop(command);) take_command(command, k, report);
}

bool FrameLoop::acquire_slot(const std::stop_token& stop, std::size_t& slot) noexcept {
  if (spec_.replay != nullptr && !spec_.replay->due[next_due_].exposed) return false;
  if (spec_.when_busy == WhenBusy::kDropFrame && spec_.replay == nullptr) {
    if (!free_count_.try_acquire()) return false;
  } else {
    while (!free_count_.try_acquire_for(kPatience))
      if (stop.stop_requested()) return false;
  }
  ENSURE(free_.pop(slot));
  return true;
}

void FrameLoop::expose(std::uint64_t k, std::size_t slot, FrameRecord& record) noexcept {
  const SimTime open = record.shutter_open;
  Slot& s = slots_[slot];
  engine::Shot shot;
  shot.sequence = k;
  shot.shutter_open = open;
  shot.exposure = spec_.exposure;
  shot.attitude = track_over(pointing_, open, spec_.exposure, [&] {
    record.trim_rad = pointing_.trim_rad();
    record.measured = pointing_.measured();
  });
  engine::Budget budget;
  if (spec_.replay != nullptr) {
    budget.passes = spec_.replay->due[next_due_].passes;
    budget.shed = spec_.replay->due[next_due_].shed;
  } else {
    budget.time = spec_.render_time;
    if (spec_.sheds) budget.shed = governor_.shed();
  }
  record.shed = budget.shed;
  record.report = generator_.expose(shot, budget, s.pixels, s.mask);
  if (budget.time > Duration{} || budget.passes > 0) record.passes = record.report.render.passes;
  s.frame = {.sequence = k,
             .shutter_open = open,
             .exposure = spec_.exposure,
             .bits = spec_.bits,
             .trim_rad = record.trim_rad,
             .measured = record.measured,
             .counts = counts_,
             .pixels = &s.pixels,
             .telemetry_row = {},
             .truth_mask = &s.mask};
  record.busy = std::max(Duration{}, clock_.now() - open - record.late);
  governor_.saw(record.busy);
  ENSURE(ready_.push(slot));
  ready_count_.release();
}

bool FrameLoop::wait_for_answer(std::uint64_t k, const std::stop_token& stop,
                                LoopReport& report) noexcept {
  const Duration give_up = SteadyClock::stopwatch() + spec_.answer_timeout;
  while (!stop.stop_requested()) {
    const Duration left = give_up - SteadyClock::stopwatch();
    if (left <= Duration{}) {
      report.answer_missing = true;
      return false;
    }
    if (!received_count_.try_acquire_for(std::min(left, kPatience))) continue;
    Command command;
    if (!received_.pop(command)) continue;
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back(command);
    } else {
      ++report.commands_lost;
    }
    if (command.answers_frame == k && !command.more_follow) return true;
  }
  return false;
}

void FrameLoop::send_frames(const std::stop_token& stop) noexcept {
  if (spec_.service_priority > 0) static_cast<void>(raise_priority(spec_.service_priority));
  // The stop comes with one count more: the ring is empty then, and only then.
  for (;;) {
    ready_count_.acquire();
    std::size_t slot = 0;
    if (!ready_.pop(slot)) {
      if (stop.stop_requested()) return;
      continue;
    }
    const engine::Status status = sink_.send(slots_[slot].frame, spec_.send_timeout);
    if (status.ok()) {
      ++sender_counts_.sent;
    } else {
      ++sender_counts_.faults;
      sender_counts_.last_fault = status.error();
    }
    ENSURE(free_.push(slot));
    free_count_.release();
  }
}

void FrameLoop::receive_commands(const std::stop_token& stop) noexcept {
  if (spec_.service_priority > 0) static_cast<void>(raise_priority(spec_.service_priority));
  while (!stop.stop_requested()) {
    const engine::Expected<Command> command = source_.receive(kPatience);
    if (command.ok()) {
      take_received(command.value());
    } else if (command.error().fault == engine::Fault::kDisconnected) {
      // Nobody is there: look again later, without eating a core.
      std::this_thread::sleep_for(kPatience / 10);
    } else if (command.error().fault != engine::Fault::kTimeout) {
      ++receiver_counts_.command_faults;
    }
  }
}

void FrameLoop::take_received(Command command) noexcept {
  if (const auto refusal = gate_.admit(command, clock_.now())) {
    refused_now_[static_cast<std::size_t>(*refusal)].fetch_add(1, std::memory_order_relaxed);
    return;
  }
  if (command.kind == CommandKind::kTrigger) {
    if (spec_.trigger != nullptr) spec_.trigger->pull();
    return;
  }
  if (spec_.open_loop) command.kind = CommandKind::kReport;
  if (received_.push(command)) {
    received_count_.release();
  } else {
    ++receiver_counts_.commands_lost;
  }
}

}  // namespace hil
