#include "tools/starloop/connections.h"

#include <nlohmann/json.hpp>

namespace starloop {
namespace {

using engine::Duration;

constexpr Duration kPatience{20'000'000};

drivers::OpenLink open(const Scenario& scenario, const hil::LoopSpec& loop) {
  const bool must_keep = loop.when_busy == hil::WhenBusy::kWait;
  return drivers::open_link(scenario.link, loop.width_px, loop.height_px,
                            must_keep ? drivers::WhenFull::kWait : drivers::WhenFull::kDropOldest);
}

}  // namespace

Connections::Connections(const Scenario& scenario, const hil::LoopSpec& loop)
    : scenario_(scenario), loop_(loop), link_(open(scenario, loop)) {
  if (scenario.link.telemetry_row) row_.emplace(link_.frames(), loop.width_px);
  if (scenario.port) {
    port_.emplace(*scenario.port);
    merged_.emplace(link_.commands(), *port_);
  }
}

Connections::~Connections() = default;

std::string Connections::text() const {
  std::string text = link_.mock() != nullptr ? "frames go to the built-in tracker"
                                             : "frames go to shared memory " + scenario_.link.name;
  if (port_ && port_->udp_port() > 0) text += "; UDP port " + std::to_string(port_->udp_port());
  if (port_ && port_->tcp_port() > 0) text += "; TCP port " + std::to_string(port_->tcp_port());
  return text;
}

hil::FrameSink& Connections::link_with_row() noexcept {
  if (row_) return *row_;
  return link_.frames();
}

void Connections::start(hil::Clock& clock, const DeviceManner& manner) {
  const bool realtime = scenario_.run.clock == ClockMode::kRealtime;
  faulty_frames_.emplace(scenario_.faults, hil::FaultySink::Shape{loop_.width_px, loop_.height_px},
                         loop_.start, link_with_row(), realtime ? &clock : nullptr);
  hil::CommandSource& commands =
      merged_ ? static_cast<hil::CommandSource&>(*merged_) : link_.commands();
  const bool lockstep = scenario_.run.clock == ClockMode::kLockstep;
  faulty_commands_.emplace(
      scenario_.faults, commands, faulty_frames_->news(),
      lockstep ? hil::FaultyCommands::Pace::kLockstep : hil::FaultyCommands::Pace::kRealtime);
  if (port_) frames_and_port_.emplace(*faulty_frames_, *port_);
  if (link_.mock() != nullptr)
    tracker_ =
        std::jthread([this, manner](const std::stop_token& stop) { run_tracker(stop, manner); });
}

void Connections::stop() {
  tracker_.request_stop();
  if (tracker_.joinable()) tracker_.join();
}

hil::FrameSink& Connections::frames() noexcept {
  if (frames_and_port_) return *frames_and_port_;
  return *faulty_frames_;
}

/// The software under test: on a thread of its own, it sees bytes and answers with bytes.
void Connections::run_tracker(const std::stop_token& stop, const DeviceManner& manner) {
  tracker::TrackerSpec spec = scenario_.tracker;
  spec.reports_only = manner.reports_only;
  tracker::Tracker tracker(spec, loop_.width_px, loop_.height_px);
  drivers::MockLink& device = *link_.mock();
  // What is still on the cable when the loop has ended is read as well.
  for (;;) {
    const auto bytes = device.next_frame(kPatience);
    if (!bytes.ok()) {
      if (stop.stop_requested()) return;
      continue;
    }
    const auto answer = tracker.on_frame(bytes.value());
    if (manner.hold > Duration{} && !stop.stop_requested())
      std::this_thread::sleep_for(manner.hold);
    if (manner.audit != nullptr) manner.audit->see(bytes.value());
    device.release_frame();
    if (answer) static_cast<void>(device.reply(answer->bytes()));
  }
}

nlohmann::ordered_json Connections::faults_json() const {
  nlohmann::ordered_json by_name = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < scenario_.faults.faults.size(); ++i)
    by_name[scenario_.faults.faults[i].name] =
        faulty_frames_->happened()[i] + faulty_commands_->happened()[i];
  const hil::FrameFaultCounts& f = faulty_frames_->counts();
  const hil::CommandFaultCounts& c = faulty_commands_->counts();
  return {{"by_name", by_name},
          {"frames",
           {{"taken", f.taken},
            {"delivered", f.delivered},
            {"dropped", f.dropped},
            {"away", f.away},
            {"refused", f.refused},
            {"held", f.held},
            {"copies", f.copies}}},
          {"commands",
           {{"taken", c.taken},
            {"delivered", c.delivered},
            {"lost", c.lost},
            {"refused", c.refused},
            {"held", c.held},
            {"copies", c.copies},
            {"stand_ins", c.stand_ins}}},
          {"records_lost", f.records_lost + c.records_lost}};
}

nlohmann::ordered_json Connections::port_json() const {
  if (!port_) return nullptr;
  nlohmann::ordered_json counts;
  const hil::PortCounts now = port_->counts();
  for (std::size_t i = 0; i < hil::kPortCounts; ++i)
    counts[name(static_cast<hil::PortCount>(i))] = now.values[i];
  return counts;
}

}  // namespace starloop
