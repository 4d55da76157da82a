#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "drivers/frame_packet.h"
#include "hil/space_packet.h"

namespace tracker {

struct TrackerSpec {
  double ifov_rad = 1.4444e-6;
  double threshold_sigma = 5;  ///< above the background
  double alpha = 0.8;          ///< share of a surprise that goes into the offset
  double beta = 0.5;           ///< and into the rate
  bool reports_only = false;   ///< says what it sees and asks for nothing
};

/// An example of software under test: sees a frame's bytes, answers with a command's bytes.
///
/// Threshold over the background's own noise, centroid of what is brighter, and one alpha-beta
/// filter an axis on what is wrong with the pointing: the target's place in the field plus the trim
/// that was on when the frame was taken. The command asks for that trim, and for its rate.
class Tracker {
 public:
  Tracker(const TrackerSpec& spec, int width_px, int height_px);

  /// Nothing for bytes that are no frame of this camera: they are counted and left alone.
  [[nodiscard]] std::optional<hil::CommandPacket> on_frame(std::span<const std::byte> bytes);
  [[nodiscard]] std::uint64_t bad_frames() const noexcept { return bad_frames_; }

 private:
  struct Background {
    double level_dn = 0;
    double noise_dn = 0;
  };
  struct Axis {
    double offset_rad = 0;
    double rate_rad_s = 0;
  };

  [[nodiscard]] Background measure_background(const drivers::FrameView& view);
  [[nodiscard]] hil::Detection detect(const drivers::FrameView& view);
  void filter(const drivers::FrameView& view, const hil::Detection& detection) noexcept;

  TrackerSpec spec_;
  int width_px_;
  int height_px_;
  std::vector<std::uint32_t> histogram_;
  std::array<Axis, 2> axes_{};
  bool locked_ = false;
  engine::SimTime last_seen_{};
  std::uint64_t sequence_ = 0;
  std::uint64_t bad_frames_ = 0;
};

}  // namespace tracker
