#pragma once

#include <cstring>
#include <vector>

#include "drivers/pixel_packing.h"
#include "drivers/usb_device/frame_intake.h"
#include "hil/camera_link.h"
#include "tests/support/numbered_frames.h"

/// Frames as a camera of numbered_frames.h gives them, and what a device makes of them.
namespace usb_frames {

using numbered_frames::kHeight_px;
using numbered_frames::kWidth_px;

[[nodiscard]] inline engine::DnImage image(std::uint64_t sequence) {
  engine::DnImage pixels(kWidth_px, kHeight_px);
  numbered_frames::fill(pixels, sequence);
  return pixels;
}

[[nodiscard]] inline hil::Frame frame(std::uint64_t sequence, const engine::DnImage& pixels) {
  hil::Frame f;
  f.sequence = sequence;
  f.shutter_open = engine::SimTime(engine::Duration(1'000'000'000)) +
                   engine::Duration(100'000'000) * static_cast<std::int64_t>(sequence);
  f.exposure = engine::Duration(1'000'000);
  f.trim_rad = {1e-3, -2e-3};
  f.measured.rate_rad_s = {1e-6, 2e-6, 3e-6};
  f.pixels = &pixels;
  return f;
}

/// Room for two frames of this camera, a telemetry row included, in both formats.
[[nodiscard]] inline drivers::UsbLimits limits() {
  drivers::UsbLimits l;
  l.formats = 3;
  l.width_px = kWidth_px;
  l.height_px = kHeight_px + 1;
  l.payload_bytes = static_cast<std::uint32_t>(
      drivers::usb_payload_bytes(drivers::PixelFormat::kPlain16, kWidth_px, kHeight_px + 1));
  l.frames = 2;
  return l;
}

/// The pixels of a whole frame, those of a telemetry row behind the others.
[[nodiscard]] inline std::vector<std::uint16_t> pixels_of(const drivers::FrameIntake::Frame& f) {
  const auto rows = static_cast<std::size_t>(f.header.height_px + f.header.rows_below);
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(f.header.width_px) * rows);
  const std::size_t bytes = f.payload.size() - f.header.news_bytes;
  if (f.header.format == drivers::PixelFormat::kPacked11) {
    drivers::unpack_pixels(f.payload.first(bytes), pixels);
  } else {
    std::memcpy(pixels.data(), f.payload.data(), bytes);
  }
  return pixels;
}

[[nodiscard]] inline bool shows(const drivers::FrameIntake::Frame& f, std::uint64_t sequence) {
  const std::vector<std::uint16_t> pixels = pixels_of(f);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (pixels[i] != numbered_frames::pixel(sequence, i)) return false;
  return f.header.sequence == sequence;
}

}  // namespace usb_frames
