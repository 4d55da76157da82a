#pragma once

#include <functional>
#include <memory>
#include <thread>

#include "hil/clock.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// What paces a run, by its clock mode: the clock, the loop's rules, the trigger, and the hiccup
/// meter beside it.
class Pacing {
 public:
  /// Opens the pipe that pulls the trigger, if there is one. Throws engine::ConfigError.
  Pacing(const Scenario& scenario, engine::SimTime start, engine::Duration lasts, bool open_loop);
  ~Pacing();
  Pacing(const Pacing&) = delete;
  Pacing& operator=(const Pacing&) = delete;

  /// Whole only after start().
  [[nodiscard]] const hil::LoopSpec& loop_spec() const noexcept { return spec_; }

  /// The start barrier: waits until somebody reads the frames. False: nobody came in time, or the
  /// run is to be given up.
  [[nodiscard]] bool wait_for_reader(const hil::FrameSink& sink,
                                     const std::function<bool()>& give_up) const;
  /// Makes clock and meter, for those who are set up with them.
  void start();
  [[nodiscard]] hil::Clock& clock() noexcept { return *clock_; }
  /// The run-up to the first shutter begins here: call it when all is ready. Returns what the
  /// system granted; empty unless the run keeps real time. The calling thread is the loop.
  [[nodiscard]] std::string enter_realtime();
  /// Ends the meter, and gives back what was granted. Null: there was no meter.
  const hil::WakeHistogram* finish();

 private:
  void read_pulls(const std::stop_token& stop) noexcept;

  RunSpec run_;
  hil::RealtimeSpec realtime_;
  hil::RealtimeGrant grant_;
  hil::LoopSpec spec_;
  hil::Trigger trigger_;
  int pipe_ = -1;
  std::unique_ptr<hil::HiccupMeter> meter_;
  std::unique_ptr<hil::Clock> clock_;
  hil::SteadyClock* steady_ = nullptr;  ///< the same, in real time
  std::jthread reader_;                 // the last member: it uses the others
};

}  // namespace starloop
