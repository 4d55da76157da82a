#pragma once

#include <array>
#include <stop_token>

#include "tools/starloop/run_folder.h"
#include "tools/starloop/truth_files.h"

namespace starloop {

/// Takes what the loop tells, keeps it, hands it to those who write it down, and shows the user
/// where the run is.
/// Thread: one of its own, for watch(); log() is the others' when it has ended.
class Observer {
 public:
  struct Peers {
    hil::FrameLoop& loop;
    hil::Recorder& recorder;
    TruthRecorder& truth;
    std::array<hil::FaultRing*, 2> faults;  ///< of frames, of commands
  };
  Observer(const Scenario& scenario, const Peers& peers, std::uint64_t frames, bool quiet);

  /// Until `stop`; asks the loop to stop when the user does (catch_signals()).
  void watch(const std::stop_token& stop, std::stop_source& loop_stop);
  [[nodiscard]] RunLog& log() noexcept { return log_; }

 private:
  void take();
  void take_commands();
  void show(const hil::FrameRecord& record, char end) const;

  const Scenario& scenario_;
  Peers peers_;
  std::uint64_t due_;
  bool quiet_;
  bool terminal_;
  std::uint64_t late_ = 0;
  std::uint64_t dropped_ = 0;
  RunLog log_;
};

/// From here on SIGINT, SIGTERM and SIGHUP end a run in order instead of at once, unless one comes
/// twice.
void catch_signals();
[[nodiscard]] bool interrupted() noexcept;

}  // namespace starloop
