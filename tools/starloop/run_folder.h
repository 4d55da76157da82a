#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "hil/camera_link.h"
#include "hil/frame_loop.h"
#include "hil/spsc_ring.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// A sink that keeps every n-th frame as a PNG. It copies the frame and writes it on a thread of
/// its own; when the disk is slow a picture is left out and counted, and nobody waits.
class PngRecorder final : public hil::FrameSink {
 public:
  PngRecorder(std::filesystem::path folder, std::uint64_t every, int width_px, int height_px,
              hil::WhenBusy when_busy);
  ~PngRecorder() override;

  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  /// Writes what is still waiting. After that no frame is taken any more.
  void finish();
  [[nodiscard]] std::uint64_t written() const noexcept { return written_; }
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  static constexpr std::size_t kSlots = 4;
  struct Slot {
    engine::DnImage pixels;
    std::uint64_t sequence = 0;
    int bits = 11;
  };
  void write_pictures() noexcept;

  std::filesystem::path folder_;
  std::uint64_t every_;
  hil::WhenBusy when_busy_;
  std::array<Slot, kSlots> slots_;
  std::atomic<bool> done_{false};
  hil::SpscRing<std::size_t, kSlots> ready_;  // sender -> writer
  hil::SpscRing<std::size_t, kSlots> free_;   // writer -> sender
  std::counting_semaphore<> ready_count_{0};
  std::counting_semaphore<> free_count_{0};
  std::uint64_t left_out_ = 0;  // the sender's own
  std::uint64_t written_ = 0;   // the writer's own until it is joined
  std::jthread writer_;
};

/// What is known of a run once it is over.
struct RunLog {
  std::vector<hil::FrameRecord> frames;
  std::vector<hil::CommandRecord> commands;
  hil::LoopReport loop;
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
/// frames.csv and commands.csv.
void write_tables(const std::filesystem::path& folder, const Scenario& scenario, const RunLog& log);
/// The contact sheet and the plot, by tools/plot/run_report.py; false when python3 or matplotlib
/// is not there.
[[nodiscard]] bool draw_pictures(const std::filesystem::path& folder, const std::string& compare);
/// report.html, by tools/plot/report_html.py, of what is in the folder by now; false as above.
[[nodiscard]] bool write_page(const std::filesystem::path& folder);

}  // namespace starloop
