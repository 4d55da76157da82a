#pragma once

#include <atomic>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>

#include "hil/frame_writer.h"
#include "hil/run_log.h"

namespace hil {

struct RecorderSpec {
  std::string log_path;
  engine::Duration sync_every{5'000'000'000};  ///< what a power cut may cost; zero: see raw_log.h
  std::uint64_t record_every = 1;  ///< frames between two that are kept with their pixels
  WhenBusy when_busy = WhenBusy::kDropFrame;
};

/// What became of what it was given: each pair adds up to that.
struct RecorderReport {
  std::uint64_t records = 0;       ///< in the log
  std::uint64_t records_lost = 0;  ///< the log's disk was full, broken or too slow
  engine::Error log_fault;         ///< why, the first time
  std::uint64_t kept = 0;          ///< frames with their pixels
  std::uint64_t left_out = 0;      ///< their disk was too slow
  std::uint64_t failed = 0;        ///< their disk said no
  std::string failure;             ///< how, the first time
};

/// Keeps a run: its log in full, and as many of its frames as asked for. The log and the pixels are
/// written on a thread each; a disk that is slow, full or gone costs records and pixels, which are
/// counted, and never the loop's time.
class Recorder final : public FrameSink {
 public:
  /// The store outlives it; without one no pixels are kept. May throw std::runtime_error.
  Recorder(const RecorderSpec& spec, const LogStart& start, FrameStore* store);
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Logs the frame with its pixels' checksum, and hands it to the store when its turn has come.
  engine::Status send(const Frame& frame, engine::Duration timeout) noexcept override;

  /// Thread: observer, for both. A frame's record comes after the commands up to that frame: pop
  /// the frame from the loop first, then the commands; log the commands first, then the frame.
  void log(const CommandRecord& command) noexcept;
  void log(const FrameRecord& frame) noexcept;

  /// Writes what is waiting and the end record. Nothing is taken any more.
  RecorderReport finish(const LoopReport& loop);

 private:
  static constexpr std::size_t kNotes = 1024;
  struct Entry {
    LogType type = LogType::kCommand;
    CommandRecord command;
    LogDecision decision;
  };
  void push(const Entry& entry) noexcept;
  void write_log() noexcept;
  void write_waiting() noexcept;
  template <class Payload>
  void append(LogType type, const Payload& payload) noexcept;
  void stop_writing() noexcept;

  RecorderSpec spec_;
  RawLog log_;  // the log thread's own
  LogBytes payload_;
  std::unique_ptr<FrameWriter> pixels_;
  SpscRing<LogFrame, kNotes> notes_;  // sender -> log thread
  SpscRing<Entry, kNotes> entries_;   // observer -> log thread
  std::counting_semaphore<> note_space_{kNotes};
  std::counting_semaphore<> entry_space_{kNotes};
  std::counting_semaphore<> waiting_{0};
  std::uint64_t notes_lost_ = 0;    // the sender's own
  std::uint64_t entries_lost_ = 0;  // the observer's own
  std::atomic<bool> done_{false};
  std::jthread writer_;
};

}  // namespace hil
