#include "tools/starloop/connections.h"

#include <nlohmann/json.hpp>

namespace starloop {
namespace {

using engine::Duration;

constexpr Duration kPatience{20'000'000};

drivers::LinkCamera camera_of(const hil::LoopSpec& loop) {
  return {loop.width_px, loop.height_px, loop.bits, loop.period};
}

nlohmann::ordered_json json_of(const drivers::UsbCounts& c) {
  return {{"connections", c.connections},
          {"resets", c.resets},
          {"halts", c.halts},
          {"bad_messages", c.bad_messages},
          {"status_requests", c.status_requests},
          {"in_errors", c.in_errors},
          {"commands_lost", c.commands_lost},
          {"device",
           {{"good", c.device.good},
            {"bad_headers", c.device.bad_headers},
            {"bad_checksums", c.device.bad_checksums},
            {"short", c.device.short_frames},
            {"long", c.device.long_frames},
            {"not_taken", c.device.not_taken}}}};
}

}  // namespace

Connections::Connections(const Scenario& scenario, const hil::LoopSpec& loop)
    : scenario_(scenario), loop_(loop), link_(scenario.link, camera_of(loop), loop.when_busy) {
  if (scenario.link.telemetry_row) row_.emplace(link_.frames(), loop.width_px);
  std::vector<hil::CommandSource*> sources = link_.commands();
  if (scenario.port) {
    port_.emplace(*scenario.port);
    sources.push_back(&*port_);
  }
  if (sources.size() > 1) merged_.emplace(sources);
}

Connections::~Connections() = default;

std::string Connections::text() const {
  std::string text = link_.text();
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
      merged_ ? static_cast<hil::CommandSource&>(*merged_) : *link_.commands().front();
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
  link_.finish();
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

nlohmann::ordered_json Connections::links_json() const {
  nlohmann::ordered_json links = nlohmann::ordered_json::array();
  for (const drivers::LinkOutcome& o : link_.outcomes()) {
    nlohmann::ordered_json link = {{"name", o.name}};
    if (!o.first) {
      link["sent"] = o.sent;
      link["left_out"] = o.left_out;
      link["failed"] = o.failed;
      link["failure"] = o.failure;
    }
    if (o.usb) link["usb"] = json_of(*o.usb);
    links.push_back(std::move(link));
  }
  return links;
}

}  // namespace starloop
