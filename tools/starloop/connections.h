#pragma once

#include <memory>
#include <optional>
#include <thread>

#include <nlohmann/json_fwd.hpp>

#include "drivers/open_link.h"
#include "hil/command_port.h"
#include "hil/faults/faulty_commands.h"
#include "hil/faults/faulty_sink.h"
#include "hil/merged_commands.h"
#include "hil/row_writer.h"
#include "tools/starloop/frame_audit.h"
#include "tools/starloop/pacing.h"

namespace starloop {

/// How the built-in tracker goes about its work.
struct DeviceManner {
  bool reports_only = false;  ///< an open loop
  engine::Duration hold{};    ///< it keeps each frame for so long: a slow reader
  FrameAudit* audit =
      nullptr;  ///< if given, sees each frame's bytes just before they are given back
};

/// What the loop is connected to: the link, the port for commands, the software under test when it
/// is the built-in tracker, and the faults on the way.
///
///     loop -> faults -> telemetry row -> link       loop <- faults <- link and port
///          -> port: what it tells of each frame
class Connections {
 public:
  /// Opens link and port. Throws engine::ConfigError, and std::runtime_error when the world does
  /// not let it.
  Connections(const Scenario& scenario, const hil::LoopSpec& loop);
  ~Connections();
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  /// One line for the user: where frames go, and where commands are taken.
  [[nodiscard]] std::string text() const;
  /// Whether somebody reads the frames.
  [[nodiscard]] const hil::FrameSink& link() const noexcept { return link_.frames(); }
  /// Sets up the faults, which need the clock of the run, and starts the built-in tracker.
  void start(hil::Clock& clock, const DeviceManner& manner);
  /// Ends the built-in tracker, and the links beside the first.
  void stop();

  [[nodiscard]] hil::FrameSink& frames() noexcept;
  [[nodiscard]] hil::CommandSource& commands() noexcept { return *faulty_commands_; }
  [[nodiscard]] std::array<hil::FaultRing*, 2> faults() noexcept {
    return {&faulty_frames_->records(), &faulty_commands_->records()};
  }
  /// report.json's "links", "faults_injected" and "command_port". After the run.
  [[nodiscard]] nlohmann::ordered_json links_json() const;
  [[nodiscard]] nlohmann::ordered_json faults_json() const;
  [[nodiscard]] nlohmann::ordered_json port_json() const;

 private:
  [[nodiscard]] hil::FrameSink& link_with_row() noexcept;
  void run_tracker(const std::stop_token& stop, const DeviceManner& manner);

  const Scenario& scenario_;
  hil::LoopSpec loop_;
  drivers::OpenLink link_;
  std::optional<hil::RowWriter> row_;
  std::optional<hil::CommandPort> port_;
  std::optional<hil::MergedCommands> merged_;
  std::optional<hil::FaultySink> faulty_frames_;
  std::optional<hil::FaultyCommands> faulty_commands_;
  std::optional<hil::FanOut> frames_and_port_;
  std::jthread tracker_;  // the last member: it uses the others
};

}  // namespace starloop
