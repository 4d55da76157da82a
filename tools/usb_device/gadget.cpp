#include "tools/usb_device/gadget.h"

#include <csignal>
#include <cstdio>
#include <ctime>

#include "drivers/usb_device/function_fs.h"
#include "drivers/usb_device/function_fs_files.h"

namespace usb_device {
namespace {

unsigned long long shown(std::uint64_t count) { return count; }

/// Blocks what ends a program for all threads to come, and waits for it in one of them.
class Ending {
 public:
  Ending() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    waiter_ = std::jthread([this](const std::stop_token& stop) { wait(stop); });
  }
  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

 private:
  void wait(const std::stop_token& stop) {
    const timespec look_again{0, 100'000'000};
    while (!stop.stop_requested()) {
      if (sigtimedwait(&signals_, nullptr, &look_again) < 0) continue;
      source_.request_stop();
      return;
    }
  }

  sigset_t signals_{};
  std::stop_source source_;
  std::jthread waiter_;  // the last member: it uses the others
};

void report(const drivers::FunctionCounts& f, const HandOverCounts& h) {
  std::printf(
      "%llu connections, %llu sessions, %llu frames: %llu taken, %llu nobody took in time, "
      "%llu of another size\n"
      "%llu requests refused, %llu reads and %llu messages failed, %llu commands lost\n",
      shown(f.connections), shown(f.sessions), shown(h.frames), shown(h.taken), shown(h.not_taken),
      shown(h.other_sizes), shown(f.refused), shown(f.failed_reads), shown(f.failed_writes),
      shown(f.commands_lost));
}

}  // namespace

void run_gadget(const std::string& folder, const HandOverSpec& spec) {
  const Ending ending;
  HandOver hand_over(spec);
  drivers::FunctionFsFiles files(folder);
  drivers::FunctionFs function(files, limits_of(spec), [&hand_over](drivers::FrameIntake& intake) {
    hand_over.take_frames(intake);
  });
  {
    const std::jthread commands = hand_over.return_commands(
        [&function](const hil::CommandPacket& packet) { function.command(packet); });
    std::printf("the gadget may be bound, frames to shared memory %s\n", spec.shm.c_str());
    std::fflush(stdout);
    function.run(ending.token());
  }
  report(function.counts(), hand_over.counts());
}

}  // namespace usb_device
