#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "drivers/frame_packet.h"
#include "hil/space_packet.h"
#include "tools/tracker/shape_gate.h"
#include "tools/tracker/sky.h"

namespace tracker {

struct TrackerSpec {
  double ifov_rad = 1.4444e-6;
  engine::PixelPoint boresight_off_px{};  ///< from the centre of pixel (width/2, height/2)
  double threshold_sigma = 5;             ///< off the background, either way
  double black_dn = 0;                    ///< of the camera, where no light falls
  double alpha = 0.8;                     ///< share of a surprise that goes into the offset
  double beta = 0.5;                      ///< and into the rate
  bool reports_only = false;              ///< says what it sees and asks for nothing
};

/// An example of software under test: sees a frame's bytes, answers with a command's bytes.
///
/// What differs from the sky around it by more than the sky's own noise, brighter or darker; of the
/// regions that this makes the largest that is where the target is expected, once it has been seen,
/// with those that its box meets; the centroid of its light; and one alpha-beta filter an axis on
/// what is wrong with the pointing: the target's place in the field plus the trim that was on when
/// the frame was taken. The command asks for that trim, and for its rate.
///
/// Before a bright sky, the Earth, a target is partly darker than what it hides. Its own light is
/// then what differs plus what it hides of the sky: the sky's level times how much of each pixel it
/// covers. That is 1 inside; at an edge the share that the difference has of the largest beside it.
/// A part that becomes as bright as the sky is lost for as long: a place that jumps together with
/// the target's area is reported with half of the confidence, and the filter goes on without it.
/// Leaves out: a target that touches what crosses the frame, as the Earth's limb does where it is
/// sharp; parts as bright as the sky are taken for sky, and gaps under 5 px for target; on a
/// telescope 60 to 130 px across that is 0.2 to 1.5 px of its centre.
class Tracker {
 public:
  Tracker(const TrackerSpec& spec, int width_px, int height_px);

  /// Nothing for bytes that are no frame of this camera: they are counted and left alone.
  [[nodiscard]] std::optional<hil::CommandPacket> on_frame(std::span<const std::byte> bytes);
  [[nodiscard]] std::uint64_t bad_frames() const noexcept { return bad_frames_; }

 private:
  struct Axis {
    double offset_rad = 0;
    double rate_rad_s = 0;
  };

  /// A region that differs, grown by the dilation.
  struct Region {
    cv::Rect box;
    int label = 0;  ///< in labels_; 0: there is none
  };
  [[nodiscard]] hil::Detection detect(const drivers::FrameView& view);
  void mark_differences(const cv::Mat& image);
  [[nodiscard]] Region choose_region(const drivers::FrameView& view);
  [[nodiscard]] bool hides_its_sky(const cv::Mat& image, const Region& region) const;
  void find_cover(const cv::Mat& image, const Region& region);
  [[nodiscard]] bool expected_in(const cv::Rect& box, const drivers::FrameView& view) const;
  void filter(const drivers::FrameView& view, hil::Detection& detection) noexcept;

  TrackerSpec spec_;
  int width_px_;
  int height_px_;
  Sky sky_;
  cv::Mat differs_;  ///< 255: off the sky by more than the threshold
  cv::Mat grown_;    ///< the same over gaps
  cv::Mat labels_;   ///< of regions of grown_
  ShapeGate gate_;
  cv::Mat cover_;          ///< of a region's box: how much of a pixel the target covers, 0 to 1
  double covered_px_ = 0;  ///< of a sky that the target hides; 0: it hides none
  std::array<Axis, 2> axes_{};
  bool locked_ = false;
  engine::SimTime last_seen_{};
  std::uint64_t sequence_ = 0;
  std::uint64_t bad_frames_ = 0;
};

}  // namespace tracker
