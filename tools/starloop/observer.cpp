#include "tools/starloop/observer.h"

#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>

#include <unistd.h>

namespace starloop {
namespace {

using engine::Duration;
using engine::seconds;

constexpr Duration kPatience{20'000'000};
constexpr Duration kLate{1'000'000};

volatile std::sig_atomic_t signalled = 0;
void on_signal(int signal) {
  // Who asks twice does not want to wait for the frame in hand.
  if (signalled != 0) std::signal(signal, SIG_DFL);
  signalled = 1;
}

}  // namespace

void catch_signals() {
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) std::signal(s, on_signal);
}

bool interrupted() noexcept { return signalled != 0; }

Observer::Observer(const Scenario& scenario, const Peers& peers, std::uint64_t frames, bool quiet)
    : scenario_(scenario),
      peers_(peers),
      due_(frames),
      quiet_(quiet),
      terminal_(isatty(fileno(stdout)) != 0) {
  log_.frames.reserve(frames);
  log_.commands.reserve(frames * 2);
}

void Observer::watch(const std::stop_token& stop, std::stop_source& loop_stop) {
  while (!stop.stop_requested()) {
    take();
    if (interrupted()) loop_stop.request_stop();
    std::this_thread::sleep_for(kPatience);
  }
  take();
  if (!quiet_ && terminal_) std::printf("\n");
}

void Observer::take() {
  bool any = false;
  for (hil::FrameRecord r; peers_.loop.frames().pop(r); any = true) {
    // The log wants a frame after the commands that it obeyed.
    take_commands();
    peers_.recorder.log(r);
    peers_.truth.add(r);
    if (r.late > kLate) ++late_;
    dropped_ += r.skipped_before + (r.handed_over ? 0U : 1U);
    log_.frames.push_back(r);
    // A log gets one line in ten frames, a terminal one line that changes.
    if (!terminal_ && r.sequence % 10 == 0) show(r, '\n');
  }
  take_commands();
  for (hil::FaultRing* ring : peers_.faults)
    for (hil::FaultRecord f; ring->pop(f);) log_.faults.push_back(f);
  if (any && terminal_) show(log_.frames.back(), '\r');
}

void Observer::take_commands() {
  for (hil::CommandRecord c; peers_.loop.commands().pop(c);) {
    peers_.recorder.log(c);
    log_.commands.push_back(c);
  }
}

void Observer::show(const hil::FrameRecord& r, char end) const {
  if (quiet_) return;
  const engine::FrameTruth& t = r.report.truth;
  const engine::StageTimes& s = r.report.times;
  const engine::PixelPoint b = scenario_.scene.camera.principal_point();
  std::printf(
      "frame %4llu/%llu  %7.2f km  %6.2f mrad/s  peak %4d DN  error %8.2f px  "
      "ms: render %5.1f optics %4.1f detector %4.1f  late %llu  dropped %llu %c",
      static_cast<unsigned long long>(r.sequence) + 1, static_cast<unsigned long long>(due_),
      t.range_m * 1e-3, t.line_of_sight_rate_rad_s * 1e3, r.report.peak_dn,
      std::hypot(t.photocentre_px.u - b.u, t.photocentre_px.v - b.v), seconds(s.render) * 1e3,
      seconds(s.optics) * 1e3, seconds(s.detector) * 1e3, static_cast<unsigned long long>(late_),
      static_cast<unsigned long long>(dropped_), end);
  std::fflush(stdout);
}

}  // namespace starloop
