#include "tools/tracker/tracker.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <opencv2/imgproc.hpp>

namespace tracker {
namespace {

// A speck of a few pixels is noise or a cosmic ray.
constexpr int kSmallestArea_px = 4;

/// The frame as OpenCV sees it. OpenCV has no view of constant pixels; nobody writes through it.
cv::Mat as_image(const drivers::FrameView& view) {
  return {view.height_px, view.width_px, CV_16UC1, const_cast<std::byte*>(view.pixels.data())};
}

}  // namespace

Tracker::Tracker(const TrackerSpec& spec, int width_px, int height_px)
    : spec_(spec), width_px_(width_px), height_px_(height_px), histogram_(65536) {
  // A pool of OpenCV's own would take time from the loop's workers.
  cv::setNumThreads(1);
}

std::optional<hil::CommandPacket> Tracker::on_frame(std::span<const std::byte> bytes) {
  const auto decoded = drivers::decode_frame(bytes);
  if (!decoded.ok() || decoded.value().width_px != width_px_ ||
      decoded.value().height_px != height_px_) {
    ++bad_frames_;
    return std::nullopt;
  }
  const drivers::FrameView& view = decoded.value();
  hil::Command command;
  command.sequence = sequence_++;
  command.answers_frame = view.frame.sequence;
  command.detection = detect(view);
  filter(view, command.detection);
  if (locked_ && !spec_.reports_only) {
    command.kind = hil::CommandKind::kTrim;
    command.trim_offset_rad = {axes_[0].offset_rad, axes_[1].offset_rad};
    command.trim_rate_rad_s = {axes_[0].rate_rad_s, axes_[1].rate_rad_s};
    command.reference = last_seen_;
  }
  command.made_at = view.frame.shutter_open + view.frame.exposure;
  return hil::encode_command(command);
}

Tracker::Background Tracker::measure_background(const drivers::FrameView& view) {
  std::fill(histogram_.begin(), histogram_.end(), 0U);
  const cv::Mat image = as_image(view);
  for (int v = 0; v < image.rows; ++v) {
    const auto* row = image.ptr<std::uint16_t>(v);
    for (int u = 0; u < image.cols; ++u) ++histogram_[row[u]];
  }
  // The median, and the spread that 84 % of a normal distribution stay under.
  const auto count = static_cast<double>(image.total());
  double below = 0;
  Background background;
  bool median_found = false;
  for (std::size_t dn = 0; dn < histogram_.size(); ++dn) {
    below += histogram_[dn];
    if (!median_found && below >= 0.5 * count) {
      background.level_dn = static_cast<double>(dn);
      median_found = true;
    }
    if (below >= 0.841 * count) {
      // Quantising hides a noise under one DN.
      background.noise_dn = std::max(0.5, static_cast<double>(dn) - background.level_dn);
      break;
    }
  }
  return background;
}

hil::Detection Tracker::detect(const drivers::FrameView& view) {
  const Background background = measure_background(view);
  const double threshold = background.level_dn + spec_.threshold_sigma * background.noise_dn;
  const cv::Mat image = as_image(view);
  cv::Mat bright = image > threshold;
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  // Close the gaps that shadows cut into the target.
  cv::dilate(bright, bright, cv::getStructuringElement(cv::MORPH_RECT, {9, 9}));
  const int count = cv::connectedComponentsWithStats(bright, labels, stats, centres, 8, CV_32S);
  int best = 0;
  for (int i = 1; i < count; ++i)
    if (best == 0 || stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(best, cv::CC_STAT_AREA))
      best = i;
  // A single pixel alone dilates to 81.
  if (best == 0 || stats.at<int>(best, cv::CC_STAT_AREA) < 81 + kSmallestArea_px) return {};

  const cv::Rect box(stats.at<int>(best, cv::CC_STAT_LEFT), stats.at<int>(best, cv::CC_STAT_TOP),
                     stats.at<int>(best, cv::CC_STAT_WIDTH),
                     stats.at<int>(best, cv::CC_STAT_HEIGHT));
  double sum = 0;
  double sum_u = 0;
  double sum_v = 0;
  for (int v = box.y; v < box.y + box.height; ++v) {
    const auto* row = image.ptr<std::uint16_t>(v);
    const auto* label = labels.ptr<int>(v);
    for (int u = box.x; u < box.x + box.width; ++u) {
      if (label[u] != best) continue;
      const double light = row[u] - background.level_dn;
      sum += light;
      sum_u += light * u;
      sum_v += light * v;
    }
  }
  if (!(sum > 0.0)) return {};
  // The dilation has grown the box by four pixels each way.
  const auto edge = [](int pixel, int grown) { return static_cast<float>(pixel + grown) - 0.5F; };
  return {.centroid_px = {sum_u / sum, sum_v / sum},
          .confidence = 1.0F,
          .id = 1,
          .box_px = {edge(box.x, 4), edge(box.y, 4), edge(box.x + box.width, -4),
                     edge(box.y + box.height, -4)}};
}

void Tracker::filter(const drivers::FrameView& view, const hil::Detection& detection) noexcept {
  if (detection.confidence <= 0.0F) return;
  const engine::SimTime middle = view.frame.shutter_open + view.frame.exposure / 2;
  // Where the target is seen, less where it ought to be seen; the boresight has to move that way.
  const std::array<double, 2> measured{
      (detection.centroid_px.u - std::floor(0.5 * width_px_)) * spec_.ifov_rad +
          view.frame.trim_rad[0],
      (detection.centroid_px.v - std::floor(0.5 * height_px_)) * spec_.ifov_rad +
          view.frame.trim_rad[1]};
  const double dt = engine::seconds(middle - last_seen_);
  for (std::size_t i = 0; i < 2; ++i) {
    Axis& axis = axes_[i];
    if (!locked_ || !(dt > 0.0)) {
      axis = {measured[i], 0.0};
      continue;
    }
    const double predicted = axis.offset_rad + axis.rate_rad_s * dt;
    const double surprise = measured[i] - predicted;
    axis.offset_rad = predicted + spec_.alpha * surprise;
    axis.rate_rad_s += spec_.beta * surprise / dt;
  }
  last_seen_ = middle;
  locked_ = true;
}

}  // namespace tracker
