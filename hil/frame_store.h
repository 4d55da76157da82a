#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/fits.h"
#include "hil/camera_link.h"
#include "hil/raw_log.h"

namespace hil {

/// Where frames are kept, one after the other. All may throw std::runtime_error.
/// Thread: one, which may wait for a disk.
class FrameStore {
 public:
  virtual ~FrameStore() = default;
  virtual void put(const Frame& frame) = 0;
  /// After the last frame.
  virtual void finish() {}
};

/// "frame_000012.png": what a frame's own file is called.
[[nodiscard]] std::string frame_name(std::uint64_t sequence, const char* suffix);

/// What a frame knows of itself, as the lines of a FITS header: number, times, trim, measured
/// attitude and rates, and what the loop had counted.
[[nodiscard]] std::vector<engine::FitsCard> frame_cards(const Frame& frame);

/// A FITS file for each frame; `run` goes into every header before the frame's own lines.
class FitsStore final : public FrameStore {
 public:
  FitsStore(std::string folder, std::vector<engine::FitsCard> run)
      : folder_(std::move(folder)), run_(std::move(run)) {}
  void put(const Frame& frame) override;

 private:
  std::string folder_;
  std::vector<engine::FitsCard> run_;
};

/// One FITS cube, a plane for each frame and beside it a table of what would be in the headers. It
/// is whole only once it is finished.
class CubeStore final : public FrameStore {
 public:
  CubeStore(const std::string& path, int width_px, int height_px,
            const std::vector<engine::FitsCard>& run)
      : cube_(path, width_px, height_px, run) {}
  void put(const Frame& frame) override { cube_.add(*frame.pixels, frame_cards(frame)); }
  void finish() override { cube_.close(); }

 private:
  engine::FitsCube cube_;
};

/// A log of its own for pixels (run_log.h, type kFrame): the quickest, and the one that a killed
/// program leaves readable. Apart from record.slog, so that a slow disk holds up no decision.
class RawStore final : public FrameStore {
 public:
  RawStore(const std::string& path, engine::Duration sync_every) : log_(path, sync_every) {}
  void put(const Frame& frame) override;

 private:
  RawLog log_;
};

}  // namespace hil
