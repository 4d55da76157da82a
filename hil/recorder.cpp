#include "hil/recorder.h"

namespace hil {

using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::Status;

namespace {

constexpr Duration kPatience{500'000'000};  // how often the log thread looks for a due sync
// The observer keeps nobody waiting: it may give a slow disk this long.
constexpr Duration kObserverWaits{1'000'000'000};

}  // namespace

Recorder::Recorder(const RecorderSpec& spec, const LogStart& start, FrameStore* store)
    : spec_(spec), log_(spec.log_path, spec.sync_every) {
  append(LogType::kStart, start);
  if (store != nullptr) {
    pixels_ = std::make_unique<FrameWriter>(*store, start.loop.width_px, start.loop.height_px,
                                            spec.when_busy);
  }
  writer_ = std::jthread([this] { write_log(); });
}

Recorder::~Recorder() { stop_writing(); }

Status Recorder::send(const Frame& frame, Duration timeout) noexcept {
  const bool space = spec_.when_busy == WhenBusy::kWait ? note_space_.try_acquire_for(timeout)
                                                        : note_space_.try_acquire();
  if (space) {
    ENSURE(notes_.push(log_frame(frame)));
    waiting_.release();
  } else {
    ++notes_lost_;
  }
  if (pixels_ != nullptr && frame.sequence % spec_.record_every == 0) {
    const Status kept = pixels_->take(frame, timeout);
    if (!kept.ok()) return kept;
  }
  return space ? Status(engine::Done{}) : Status(Error{Fault::kBusy, 0, "log"});
}

void Recorder::log(const CommandRecord& command) noexcept {
  push({LogType::kCommand, command, {}});
}

void Recorder::log(const FrameRecord& frame) noexcept {
  using Kind = LogDecision::Kind;
  const Kind exposed = frame.shed != engine::Shed::kNothing ? Kind::kExposedInHaste
                       : frame.passes > 0                   ? Kind::kExposedInPasses
                                                            : Kind::kExposed;
  push({LogType::kDecision,
        {},
        {.kind = frame.handed_over ? exposed : Kind::kDropped,
         .frame = frame.sequence,
         .shutter_open = frame.shutter_open,
         .late = frame.late,
         .skipped_before = frame.skipped_before,
         .passes = frame.passes,
         .shed = frame.shed}});
}

void Recorder::push(const Entry& entry) noexcept {
  if (!entry_space_.try_acquire_for(kObserverWaits)) {
    ++entries_lost_;
    return;
  }
  ENSURE(entries_.push(entry));
  waiting_.release();
}

RecorderReport Recorder::finish(const LoopReport& loop) {
  stop_writing();
  const std::uint64_t lost = notes_lost_ + entries_lost_;
  append(LogType::kEnd, LogEnd{loop, lost + log_.lost()});
  RecorderReport report;
  report.records = log_.written();
  report.records_lost = lost + log_.lost();
  if (log_.lost() > 0) {
    report.log_fault = log_.fault();
  } else if (lost > 0) {
    report.log_fault = {Fault::kBusy, 0, "log"};
  }
  if (pixels_ != nullptr) {
    pixels_->finish();
    report.kept = pixels_->written();
    report.left_out = pixels_->left_out();
    report.failed = pixels_->failed();
    report.failure = pixels_->failure();
  }
  return report;
}

void Recorder::stop_writing() noexcept {
  if (!writer_.joinable()) return;
  done_ = true;
  waiting_.release();
  writer_.join();
}

void Recorder::write_log() noexcept {
  for (;;) {
    // Before the last look: what was pushed before done_ was set is then found by it.
    const bool last = done_;
    write_waiting();
    if (last) return;
    static_cast<void>(waiting_.try_acquire_for(kPatience));
    log_.sync_if_due();
  }
}

void Recorder::write_waiting() noexcept {
  for (Entry entry; entries_.pop(entry);) {
    entry_space_.release();
    if (entry.type == LogType::kCommand) {
      append(entry.type, entry.command);
    } else {
      append(entry.type, entry.decision);
    }
  }
  for (LogFrame note; notes_.pop(note);) {
    note_space_.release();
    append(LogType::kFrame, note);
  }
}

template <class Payload>
void Recorder::append(LogType type, const Payload& payload) noexcept {
  encode(payload, payload_);
  static_cast<void>(log_.append(static_cast<std::uint32_t>(type), payload_));
}

}  // namespace hil
