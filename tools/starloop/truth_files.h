#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <optional>
#include <semaphore>
#include <thread>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "hil/camera_link.h"
#include "hil/frame_loop.h"
#include "hil/spsc_ring.h"
#include "tools/starloop/quality_files.h"

namespace starloop {

/// A mask as COCO wants it when it is not packed: lengths of runs that alternate between outside
/// and inside, outside first, down the columns from the left. They add up to width * height.
[[nodiscard]] std::vector<std::uint32_t> coco_run_lengths(
    std::span<const engine::TruthMask::Run> runs, int width_px, int height_px);

/// What each frame really showed, as two files of a run's folder; and how good a picture it is,
/// which needs no truth, but is known on the same thread.
///
/// truth.jsonl: an object a line and frame, dropped ones too, written as the run goes. Pixel (0, 0)
/// has its centre at (0, 0); `box_px` and the mask's runs are whole pixels, ends excluded. `mask`
/// is null when there is none to tell of: the frame was dropped, or the writer was too slow.
/// coco.json: the frames of which there is a picture, as COCO's object detection data; there pixel
/// (0, 0) reaches from 0 to 1, so that its coordinates are ours plus one half. Written at the end.
///
/// A sink: it copies a frame's mask, scores its picture and never waits when frames may be dropped;
/// the disk is the business of a thread of its own. A mask and its frame's record come on two
/// threads, in any order in time, each ascending.
class TruthRecorder final : public hil::FrameSink {
 public:
  struct Spec {
    std::filesystem::path folder;
    std::uint64_t picture_every = 1;  ///< as PngRecorder
    int width_px = 0;
    int height_px = 0;
    std::vector<std::string> companions{};  ///< their names
    std::vector<std::string> parts{};       ///< theirs
    /// Of frames that are to be scored: in truth.jsonl, and in quality.csv.
    std::optional<quality::CameraFigures> camera{};
    hil::WhenBusy when_busy = hil::WhenBusy::kDropFrame;
  };
  /// Throws std::runtime_error when truth.jsonl cannot be made.
  explicit TruthRecorder(const Spec& spec);
  ~TruthRecorder() override;

  /// Thread: sender.
  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  /// Thread: the observer of the loop.
  void add(const hil::FrameRecord& record) noexcept;
  /// Writes what is still waiting, and coco.json of the pictures that are there by now: after the
  /// recorder of pictures has finished. After that nothing is taken any more.
  void finish();

  /// After finish(): frames == lines written + records_lost.
  [[nodiscard]] std::uint64_t lines() const noexcept { return lines_; }
  [[nodiscard]] std::uint64_t records_lost() const noexcept { return records_lost_; }
  [[nodiscard]] std::uint64_t masks_lost() const noexcept { return masks_lost_; }
  /// report.json's "truth".
  [[nodiscard]] nlohmann::ordered_json json() const;
  /// report.json's "image_quality": null when frames are not scored.
  [[nodiscard]] nlohmann::ordered_json quality_json() const;

 private:
  static constexpr std::size_t kSlots = 64;
  struct Slot {
    engine::TruthMask mask;
    std::optional<quality::ImageQuality> quality;
    std::uint64_t sequence = 0;
  };
  void serve() noexcept;
  /// False: a record's mask may still come.
  [[nodiscard]] bool write_next(bool all_is_in);
  /// Without a slot: the frame was dropped, or the writer was too slow.
  void write_line(const hil::FrameRecord& record, const Slot* slot);
  void add_to_coco(const hil::FrameRecord& record, const engine::TruthMask& mask);
  void write_coco();

  Spec spec_;
  std::optional<quality::Meter> meter_;  // the sender's own
  std::optional<QualityTable> qualities_;
  std::ofstream file_;
  std::array<Slot, kSlots> slots_;
  hil::SpscRing<std::size_t, kSlots> ready_;      // sender -> writer
  hil::SpscRing<std::size_t, kSlots> free_;       // writer -> sender
  hil::SpscRing<hil::FrameRecord, 512> records_;  // observer -> writer
  std::counting_semaphore<> free_count_{0};
  std::counting_semaphore<> news_{0};
  std::atomic<bool> done_{false};
  std::uint64_t masks_lost_ = 0;    // the sender's own
  std::uint64_t records_lost_ = 0;  // the observer's own
  std::uint64_t lines_ = 0;         // with the rest, the writer's own until it is joined
  std::optional<hil::FrameRecord> next_record_;
  std::optional<std::size_t> next_mask_;
  std::unique_ptr<nlohmann::ordered_json> coco_;
  std::jthread writer_;
};

}  // namespace starloop
