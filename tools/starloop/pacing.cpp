#include "tools/starloop/pacing.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

namespace starloop {
namespace {

using engine::Duration;

// Set-up to first shutter: time for the threads to stand ready.
constexpr Duration kRunUp{500'000'000};
constexpr Duration kPatience{10'000'000};

hil::LoopSpec loop_spec(const Scenario& scenario, engine::SimTime start, Duration lasts) {
  const RunSpec& run = scenario.run;
  hil::LoopSpec spec;
  spec.start = start;
  spec.period = run.period;
  spec.frames = static_cast<std::uint64_t>(lasts / run.period) + 1;
  spec.exposure = run.exposure;
  spec.command_lead = run.command_lead;
  spec.render_time = run.render_time;
  spec.sheds = run.sheds;
  spec.width_px = scenario.scene.camera.width_px;
  spec.height_px = scenario.scene.camera.height_px;
  spec.bits = scenario.detector.bits;
  // A slow cable may take all of the time that there is.
  spec.send_timeout = std::max(spec.send_timeout, run.period);
  if (run.clock != ClockMode::kRealtime) {
    spec.when_busy = hil::WhenBusy::kWait;
    spec.send_timeout = run.answer_timeout;
  }
  if (run.clock == ClockMode::kLockstep) spec.answer_timeout = run.answer_timeout;
  return spec;
}

int open_pipe(const Scenario& scenario) {
  const std::string& name = scenario.run.trigger;
  if (scenario.run.clock != ClockMode::kTriggered || name == "packet") return -1;
  if (name == "stdin") return dup(STDIN_FILENO);
  // For reading and writing: a pipe whose writer comes later, or goes and comes back, stays open.
  const int descriptor = open(name.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0)
    throw engine::ConfigError(scenario.run.trigger_where +
                              " must be \"packet\", \"stdin\" or a pipe that exists, got \"" +
                              name + "\": " + std::strerror(errno));
  return descriptor;
}

}  // namespace

Pacing::Pacing(const Scenario& scenario, engine::SimTime start, Duration lasts, bool open_loop)
    : run_(scenario.run),
      realtime_(scenario.realtime),
      spec_(starloop::loop_spec(scenario, start, lasts)),
      pipe_(open_pipe(scenario)) {
  spec_.open_loop = open_loop;
  if (run_.clock == ClockMode::kRealtime && realtime_.priority > 0)
    spec_.service_priority = realtime_.priority + 1;
  if (run_.clock == ClockMode::kTriggered) {
    spec_.trigger = &trigger_;
    spec_.trigger_timeout = run_.trigger_timeout;
  }
  if (pipe_ >= 0) reader_ = std::jthread([this](const std::stop_token& s) { read_pulls(s); });
}

Pacing::~Pacing() {
  reader_ = {};
  if (pipe_ >= 0) close(pipe_);
}

void Pacing::read_pulls(const std::stop_token& stop) noexcept {
  std::array<char, 256> text{};
  while (!stop.stop_requested()) {
    pollfd ready{pipe_, POLLIN, 0};
    if (poll(&ready, 1, 50) <= 0) continue;
    const ssize_t n = read(pipe_, text.data(), text.size());
    if (n == 0) return;  // the end: no more pulls
    for (ssize_t i = 0; i < n; ++i)
      if (text[static_cast<std::size_t>(i)] == '\n') trigger_.pull();
  }
}

bool Pacing::wait_for_reader(const hil::FrameSink& sink,
                             const std::function<bool()>& give_up) const {
  for (Duration waited{}; !sink.has_reader(); waited += kPatience) {
    if (give_up() || waited >= run_.start_timeout) return false;
    std::this_thread::sleep_for(kPatience);
  }
  return true;
}

void Pacing::start() {
  if (run_.clock == ClockMode::kRealtime) {
    const int above_services = realtime_.priority > 0 ? realtime_.priority + 2 : 0;
    meter_ = std::make_unique<hil::HiccupMeter>(above_services);
    spec_.hiccups = meter_.get();
    auto steady = std::make_unique<hil::SteadyClock>(spec_.start - kRunUp);
    steady_ = steady.get();
    clock_ = std::move(steady);
  } else {
    clock_ = std::make_unique<hil::ManualClock>(spec_.start - run_.period);
  }
}

std::string Pacing::enter_realtime() {
  if (steady_ == nullptr) return {};
  grant_ = hil::enter_realtime(realtime_);
  // However long that and the set-up before it took.
  steady_->restart(spec_.start - kRunUp);
  return grant_.text;
}

const hil::WakeHistogram* Pacing::finish() {
  hil::leave_realtime(grant_);
  return meter_ ? &meter_->finish() : nullptr;
}

}  // namespace starloop
