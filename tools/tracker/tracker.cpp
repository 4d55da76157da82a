#include "tools/tracker/tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace tracker {
namespace {

// A speck of a few pixels is noise or a cosmic ray.
constexpr int kSmallestArea_px = 4;
constexpr int kSpeckShare = 8;  // and so is what has this small a part of the largest region
constexpr double kExpected_px =
    32;                         // a target is so far from its place at most, beside half its size
constexpr int kDarkShare = 20;  // one in so many
constexpr double kWing = 0.1;   // less of the brightest pixel within two is its wing

/// The frame as OpenCV sees it. OpenCV has no view of constant pixels; nobody writes through it.
cv::Mat as_image(const drivers::FrameView& view) {
  return {view.height_px, view.width_px, CV_16UC1, const_cast<std::byte*>(view.pixels.data())};
}

}  // namespace

Tracker::Tracker(const TrackerSpec& spec, int width_px, int height_px)
    : spec_(spec), width_px_(width_px), height_px_(height_px), sky_(width_px, height_px) {
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

void Tracker::mark_differences(const cv::Mat& image) {
  differs_.create(image.size(), CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    const auto* row = image.ptr<std::uint16_t>(v);
    auto* out = differs_.ptr<std::uint8_t>(v);
    for (int begin = 0; begin < image.cols; begin += Sky::kBlock_px) {
      const Sky::Block& sky = sky_.at(begin, v);
      const double off_dn = spec_.threshold_sigma * sky.noise_dn;
      const auto darkest =
          static_cast<std::uint16_t>(std::max(0.0, std::ceil(sky.level_dn - off_dn)));
      const auto brightest =
          static_cast<std::uint16_t>(std::clamp(std::floor(sky.level_dn + off_dn), 0.0, 65535.0));
      const int end = std::min(image.cols, begin + Sky::kBlock_px);
      for (int u = begin; u < end; ++u) out[u] = row[u] < darkest || row[u] > brightest ? 255 : 0;
    }
  }
}

bool Tracker::expected_in(const cv::Rect& box, const drivers::FrameView& view) const {
  const double dt = engine::seconds(view.frame.shutter_open + view.frame.exposure / 2 - last_seen_);
  const auto place = [&](std::size_t i, int side_px) {
    const Axis& axis = axes_[i];
    const double off_rad = axis.offset_rad + axis.rate_rad_s * dt - view.frame.trim_rad[i];
    return std::floor(0.5 * side_px) + off_rad / spec_.ifov_rad;
  };
  const auto inside = [](double x, int begin, int size) {
    const double beside = kExpected_px + 0.5 * size;
    return x >= begin - beside && x <= begin + size + beside;
  };
  return inside(place(0, width_px_), box.x, box.width) &&
         inside(place(1, height_px_), box.y, box.height);
}

Tracker::Region Tracker::choose_region(const drivers::FrameView& view) {
  cv::Mat stats;
  cv::Mat centres;
  // Close the gaps that shadows cut into the target.
  cv::dilate(differs_, grown_, cv::getStructuringElement(cv::MORPH_RECT, {9, 9}));
  const int count = cv::connectedComponentsWithStats(grown_, labels_, stats, centres, 8, CV_32S);
  const auto box_of = [&stats](int i) {
    return cv::Rect(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                    stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
  };
  // A single pixel alone dilates to 81. A limb or a terminator crosses the frame.
  const auto may_be_target = [&](int i) {
    const cv::Rect box = box_of(i);
    return stats.at<int>(i, cv::CC_STAT_AREA) >= 81 + kSmallestArea_px && box.width < width_px_ &&
           box.height < height_px_;
  };
  int largest = 0;
  for (int i = 1; i < count; ++i)
    if (may_be_target(i)) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  Region best;
  std::pair<bool, int> best_rank;
  for (int i = 1; i < count; ++i) {
    if (!may_be_target(i)) continue;
    const int area = stats.at<int>(i, cv::CC_STAT_AREA);
    // A speck is no target for being near its place.
    const bool expected = locked_ && kSpeckShare * area >= largest && expected_in(box_of(i), view);
    const std::pair rank(expected, area);
    if (best.label != 0 && rank <= best_rank) continue;
    best = {box_of(i), i};
    best_rank = rank;
  }
  if (best.label == 0) return best;
  // A panel may stand off by more than the gaps that have been closed.
  const cv::Rect core = best.box;
  for (int i = 1; i < count; ++i) {
    const cv::Rect box = box_of(i);
    if (i == best.label || !may_be_target(i) || (box & core).area() == 0) continue;
    labels_(box).setTo(best.label, labels_(box) == i);
    best.box |= box;
  }
  return best;
}

/// Noise alone makes few pixels of a bright target darker than the sky.
bool Tracker::hides_its_sky(const cv::Mat& image, const Region& region) const {
  int dark = 0;
  int all = 0;
  for (int v = region.box.y; v < region.box.br().y; ++v) {
    for (int u = region.box.x; u < region.box.br().x; ++u) {
      if (labels_.at<int>(v, u) != region.label || differs_.at<std::uint8_t>(v, u) == 0) continue;
      ++all;
      if (image.at<std::uint16_t>(v, u) < sky_.at(u, v).level_dn) ++dark;
    }
  }
  return kDarkShare * dark > all;
}

void Tracker::find_cover(const cv::Mat& image, const Region& region) {
  const cv::Rect& box = region.box;
  cv::Mat brighter(box.size(), CV_32FC1, cv::Scalar(0));
  cv::Mat darker(box.size(), CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < box.height; ++v) {
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      if (labels_.at<int>(p) != region.label || differs_.at<std::uint8_t>(p) == 0) continue;
      const auto off = static_cast<float>(image.at<std::uint16_t>(p) - sky_.at(p.x, p.y).level_dn);
      (off > 0.0F ? brighter : darker).at<float>(v, u) = std::abs(off);
    }
  }
  const cv::Mat around = cv::getStructuringElement(cv::MORPH_RECT, {5, 5});
  cv::Mat brightest;
  cv::Mat darkest;
  cv::dilate(brighter, brightest, around);
  cv::dilate(darker, darkest, around);
  // The wings of a glint reach far over the target's edge.
  brighter.setTo(0, brighter < kWing * brightest);
  cv::Mat inside = (brighter > 0) | (darker > 0);
  cv::morphologyEx(inside, inside, cv::MORPH_CLOSE, around);
  cv::erode(inside, inside, around);
  cover_.create(box.size(), CV_32FC1);
  for (int v = 0; v < box.height; ++v) {
    for (int u = 0; u < box.width; ++u) {
      const float bright = brighter.at<float>(v, u);
      const float dark = darker.at<float>(v, u);
      float cover = 0;
      if (bright > 0.0F) cover = bright / brightest.at<float>(v, u);
      if (dark > 0.0F) cover = dark / darkest.at<float>(v, u);
      cover_.at<float>(v, u) = inside.at<std::uint8_t>(v, u) != 0 ? 1.0F : cover;
    }
  }
}

hil::Detection Tracker::detect(const drivers::FrameView& view) {
  const cv::Mat image = as_image(view);
  sky_.measure(image);
  mark_differences(image);
  const Region region = choose_region(view);
  covered_px_ = 0.0;
  if (region.label == 0) return {};
  const bool hides = hides_its_sky(image, region);
  if (hides) {
    find_cover(image, region);
    covered_px_ = cv::sum(cover_)[0];
  }
  const cv::Rect& box = region.box;
  double sum = 0;
  double sum_u = 0;
  double sum_v = 0;
  for (int v = box.y; v < box.br().y; ++v) {
    for (int u = box.x; u < box.br().x; ++u) {
      if (labels_.at<int>(v, u) != region.label) continue;
      const double sky_dn = sky_.at(u, v).level_dn;
      double light = image.at<std::uint16_t>(v, u) - sky_dn;
      if (hides)
        light +=
            static_cast<double>(cover_.at<float>(v - box.y, u - box.x)) * (sky_dn - spec_.black_dn);
      sum += light;
      sum_u += light * u;
      sum_v += light * v;
    }
  }
  if (!(sum > 0.0)) return {};
  const cv::Point2d centroid(sum_u / sum, sum_v / sum);
  // Of a target with next to no light of its own the noise would say where it is.
  if (!cv::Rect2d(box).contains(centroid)) return {};
  // The dilation has grown the box by four pixels each way.
  const auto edge = [](int pixel, int grown) { return static_cast<float>(pixel + grown) - 0.5F; };
  return {.centroid_px = {centroid.x, centroid.y},
          .confidence = 1.0F,
          .id = 1,
          .box_px = {edge(box.x, 4), edge(box.y, 4), edge(box.x + box.width, -4),
                     edge(box.y + box.height, -4)}};
}

void Tracker::filter(const drivers::FrameView& view, hil::Detection& detection) noexcept {
  if (detection.confidence <= 0.0F) return;
  const engine::SimTime middle = view.frame.shutter_open + view.frame.exposure / 2;
  // Where the target is seen, less where it ought to be seen; the boresight has to move that way.
  const std::array<double, 2> measured{
      (detection.centroid_px.u - std::floor(0.5 * width_px_) - spec_.boresight_off_px.u) *
              spec_.ifov_rad +
          view.frame.trim_rad[0],
      (detection.centroid_px.v - std::floor(0.5 * height_px_) - spec_.boresight_off_px.v) *
              spec_.ifov_rad +
          view.frame.trim_rad[1]};
  const double dt = engine::seconds(middle - last_seen_);
  const auto predicted_rad = [&](std::size_t i) {
    return axes_[i].offset_rad + axes_[i].rate_rad_s * dt;
  };
  const double surprise_px =
      std::hypot(measured[0] - predicted_rad(0), measured[1] - predicted_rad(1)) / spec_.ifov_rad;
  // Before a dark sky what cannot be seen has no light, and there is nothing to be mistaken in.
  if (!(covered_px_ > 0.0)) {
    gate_.forget();
  } else if (!gate_.believes(covered_px_, surprise_px, middle)) {
    detection.confidence = 0.5F;
    return;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    Axis& axis = axes_[i];
    if (!locked_ || !(dt > 0.0)) {
      axis = {measured[i], 0.0};
      continue;
    }
    const double predicted = predicted_rad(i);
    const double surprise = measured[i] - predicted;
    axis.offset_rad = predicted + spec_.alpha * surprise;
    axis.rate_rad_s += spec_.beta * surprise / dt;
  }
  last_seen_ = middle;
  locked_ = true;
}

}  // namespace tracker
