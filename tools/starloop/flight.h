#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "tools/starloop/connections.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/run_folder.h"

namespace starloop {

/// One pass flown through the loop, from the opened link to the closed logs: what `run` and `soak`
/// share.
class Flight {
 public:
  struct Plan {
    const ScenarioSource& source;
    const Scenario& scenario;
    engine::Pass pass;
    bool open_loop = false;
    bool quiet = false;  ///< no line about where the run is
  };
  /// What a flight leaves besides the loop's own log.
  struct Result {
    RunLog log;
    hil::RecorderReport kept;
    nlohmann::ordered_json links;
    nlohmann::ordered_json faults_injected;
    nlohmann::ordered_json command_port;
    nlohmann::ordered_json truth;
    nlohmann::ordered_json image_quality;
  };

  /// Opens link, port and trigger. Throws engine::ConfigError, and std::runtime_error when the
  /// world does not let it.
  Flight(const Plan& plan, Rig& rig);
  ~Flight();
  Flight(const Flight&) = delete;
  Flight& operator=(const Flight&) = delete;

  /// One line for the user: where frames go, and where commands are taken.
  [[nodiscard]] std::string text() const { return connections_.text(); }
  /// The start barrier. False: nobody came to read in time, or the user gave up.
  [[nodiscard]] bool wait_for_reader() const;
  /// Runs the loop, once; its logs go into `folder`. The calling thread is the loop's.
  [[nodiscard]] Result fly(const std::filesystem::path& folder, const DeviceManner& manner);

 private:
  Plan plan_;
  Rig& rig_;
  Pacing pacing_;
  Connections connections_;
};

}  // namespace starloop
