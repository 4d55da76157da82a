#include "tools/usb_device/camera_source.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace usb_device {
namespace {

using engine::Duration;

constexpr int kPatience_ms = 100;
constexpr int kPatienceWithTheSecond_ms = 2000;

drivers::FrameView view_of(const starloop_frame& f) {
  drivers::FrameView view;
  view.width_px = f.width_px;
  view.height_px = f.height_px;
  const std::span<const std::uint16_t> all(f.pixels, f.payload_bytes / 2);
  const std::size_t image =
      static_cast<std::size_t>(f.width_px) * static_cast<std::size_t>(f.height_px);
  view.pixels = std::as_bytes(all.first(image));
  view.telemetry_row = std::as_bytes(all.subspan(image));
  hil::Frame& frame = view.frame;
  frame.sequence = f.sequence;
  frame.shutter_open = engine::SimTime(Duration(f.shutter_open_ns));
  frame.exposure = Duration(f.exposure_ns);
  frame.bits = f.bits;
  std::copy_n(f.trim_rad, 2, frame.trim_rad.begin());
  std::copy_n(f.j2000_to_camera, 4, frame.measured.j2000_to_camera.begin());
  std::copy_n(f.rate_rad_s, 3, frame.measured.rate_rad_s.begin());
  frame.counts = {
      .skipped = f.skipped, .dropped = f.dropped, .late = f.late, .commands = f.commands};
  return view;
}

starloop_command command_of(const hil::Command& c) {
  starloop_command out{};
  out.kind = static_cast<starloop_kind>(c.kind);
  out.answer.answers_frame = c.answers_frame;
  out.answer.made_at_ns = c.made_at.time_since_epoch().count();
  out.answer.time_to_live_ns = c.time_to_live.count();
  out.answer.more_follow = c.more_follow ? 1 : 0;
  out.answer.detection.centroid_px[0] = static_cast<float>(c.detection.centroid_px.u);
  out.answer.detection.centroid_px[1] = static_cast<float>(c.detection.centroid_px.v);
  out.answer.detection.confidence = c.detection.confidence;
  out.answer.detection.id = c.detection.id;
  std::copy(c.trim_offset_rad.begin(), c.trim_offset_rad.end(), out.trim_offset_rad);
  std::copy(c.trim_rate_rad_s.begin(), c.trim_rate_rad_s.end(), out.trim_rate_rad_s);
  out.reference_ns = c.reference.time_since_epoch().count();
  out.mode = static_cast<starloop_mode>(c.mode);
  return out;
}

bool is_a_camera(const starloop_frame& f) {
  return std::min(f.width_px, f.height_px) >= 1 &&
         std::max(f.width_px, f.height_px) <= drivers::kLargestSide_px && f.bits >= 1 &&
         f.bits <= 16;
}

}  // namespace

void CameraSource::close() {
  const std::lock_guard lock(mutex_);
  starloop_close(std::exchange(client_, nullptr));
}

starloop_status CameraSource::next_frame(starloop_frame& frame) {
  if (client_ == nullptr) {
    starloop_client* client = nullptr;
    const starloop_status status = starloop_open(&client, name_.c_str(), kPatience_ms);
    const std::lock_guard lock(mutex_);
    client_ = client;
    if (status != STARLOOP_OK) return status;
  }
  const starloop_status status = starloop_wait_frame(client_, &frame, kPatience_ms);
  if (status == STARLOOP_DISCONNECTED || status == STARLOOP_SYSTEM) close();
  return status;
}

drivers::UvcSpec CameraSource::wait_for_camera() {
  drivers::UvcSpec spec;
  starloop_frame first{};
  bool has_first = false;
  std::string said;
  int patience_ms = kPatienceWithTheSecond_ms;
  for (;;) {
    starloop_frame frame;
    const starloop_status status = next_frame(frame);
    if (status != STARLOOP_OK) {
      if (has_first && (patience_ms -= kPatience_ms) <= 0) return spec;
      if (!has_first && status != STARLOOP_TIMEOUT && said != starloop_last_error()) {
        said = starloop_last_error();
        std::printf("waiting for frames: %s\n", said.c_str());
        std::fflush(stdout);
      }
      continue;
    }
    static_cast<void>(starloop_release_frame(client_, &frame));
    if (!is_a_camera(frame)) continue;
    spec.width_px = frame.width_px;
    spec.height_px = frame.height_px;
    spec.rows_below = frame.telemetry_row != nullptr ? 1 : 0;
    spec.bits = frame.bits;
    if (has_first && frame.sequence > first.sequence &&
        frame.shutter_open_ns > first.shutter_open_ns) {
      const std::int64_t frames = static_cast<std::int64_t>(frame.sequence - first.sequence);
      spec.period = Duration((frame.shutter_open_ns - first.shutter_open_ns) / frames);
      return spec;
    }
    first = frame;
    has_first = true;
  }
}

std::jthread CameraSource::follow(drivers::UvcCamera& camera, Post post,
                                  std::function<void()> changed) {
  return std::jthread([this, &camera, post = std::move(post),
                       changed = std::move(changed)](const std::stop_token& stop) {
    read_frames(stop, camera, post, changed);
  });
}

void CameraSource::read_frames(const std::stop_token& stop, drivers::UvcCamera& camera,
                               const Post& post, const std::function<void()>& changed) {
  while (!stop.stop_requested()) {
    starloop_frame frame;
    if (next_frame(frame) != STARLOOP_OK) continue;
    bool same = true;
    // One at a time: while the camera is busy the link drops the oldest, not the newest.
    post([this, &camera, &frame, &same] {
      same = camera.offer(view_of(frame));
      offered_.release();
    });
    while (!offered_.try_acquire_for(std::chrono::milliseconds(kPatience_ms)))
      if (stop.stop_requested()) return;
    static_cast<void>(starloop_release_frame(client_, &frame));
    if (same) continue;
    changed();
    return;
  }
}

bool CameraSource::send(const hil::Command& command) {
  const starloop_command c = command_of(command);
  const std::lock_guard lock(mutex_);
  return client_ != nullptr && starloop_send(client_, &c) == STARLOOP_OK;
}

}  // namespace usb_device
