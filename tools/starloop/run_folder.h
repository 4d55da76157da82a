#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hil/faults/fault_record.h"
#include "hil/frame_loop.h"
#include "hil/recorder.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// Keeps frames as PNGs, a file each.
class PngStore final : public hil::FrameStore {
 public:
  explicit PngStore(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void put(const hil::Frame& frame) override;

 private:
  std::filesystem::path folder_;
};

/// Where the frames of a run are kept, as record.frames says; null for none.
[[nodiscard]] std::unique_ptr<hil::FrameStore> make_store(const std::filesystem::path& folder,
                                                          const Scenario& scenario,
                                                          RecordFrames frames);
/// How a log of this run begins.
[[nodiscard]] hil::LogStart log_start(const ScenarioSource& source, const Scenario& scenario,
                                      const hil::LoopSpec& loop, int threads);

/// What is known of a run once it is over.
struct RunLog {
  std::vector<hil::FrameRecord> frames;
  std::vector<hil::CommandRecord> commands;
  std::vector<hil::FaultRecord> faults;
  hil::LoopReport loop;
  std::string realtime;                       ///< what the system granted
  std::optional<hil::WakeHistogram> machine;  ///< its own stalls; in real time only
};

/// How well the camera pointed, from `after` on: over the frames that show the target.
struct PointingScore {
  double rms_px = 0;
  double worst_px = 0;
  std::uint64_t frames = 0;
  std::uint64_t without_target = 0;    ///< frames on whose detector none of its light fell
  std::optional<double> lost_after_s;  ///< since the start: the target's centre leaves the frame
};
[[nodiscard]] PointingScore score_pointing(const Scenario& scenario, const RunLog& log,
                                           double after_s);

/// out/<scenario>/<UTC time>/, and the link out/latest to it. Throws std::runtime_error.
[[nodiscard]] std::filesystem::path make_run_folder(const std::string& out,
                                                    const std::string& scenario);
/// frames.csv and commands.csv; faults.csv when the scenario has any.
void write_tables(const std::filesystem::path& folder, const Scenario& scenario, const RunLog& log);
/// The contact sheet and the plot, by tools/plot/run_report.py; false when python3 or matplotlib
/// is not there.
[[nodiscard]] bool draw_pictures(const std::filesystem::path& folder, const std::string& compare);
/// report.html, by tools/plot/report_html.py, of what is in the folder by now; false as above.
[[nodiscard]] bool write_page(const std::filesystem::path& folder);

}  // namespace starloop
