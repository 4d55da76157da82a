#pragma once

#include <cstring>
#include <vector>

#include "drivers/frame_packet.h"
#include "drivers/usb_device/uvc_descriptors.h"
#include "tests/support/numbered_frames.h"
#include "tests/support/usbip_host.h"

/// Frames that show which frame they are, of any size, and what each format makes of them.
namespace uvc_frames {

using usbip_host::Bytes;

inline drivers::UvcSpec spec(int width_px = numbered_frames::kWidth_px,
                             int height_px = numbered_frames::kHeight_px, int rows_below = 0) {
  drivers::UvcSpec s;
  s.width_px = width_px;
  s.height_px = height_px;
  s.rows_below = rows_below;
  return s;
}

/// A frame and its pixels.
struct Picture {
  Picture(const drivers::UvcSpec& s, std::uint64_t sequence) {
    const auto width = static_cast<std::size_t>(s.width_px);
    const std::size_t image = width * static_cast<std::size_t>(s.height_px);
    for (std::size_t i = 0; i < image; ++i) pixels.push_back(numbered_frames::pixel(sequence, i));
    for (std::size_t i = 0; i < width * static_cast<std::size_t>(s.rows_below); ++i)
      pixels.push_back(static_cast<std::uint16_t>((sequence + 3 * i) & 0xFFU));
    view.width_px = s.width_px;
    view.height_px = s.height_px;
    const auto bytes = std::as_bytes(std::span(pixels));
    view.pixels = bytes.first(2 * image);
    view.telemetry_row = bytes.subspan(2 * image);
    hil::Frame& f = view.frame;
    f.sequence = sequence;
    f.bits = s.bits;
    f.shutter_open = engine::SimTime(s.period * static_cast<std::int64_t>(sequence));
    f.exposure = engine::Duration(2'000'000);
    f.trim_rad = {1e-6 * static_cast<double>(sequence), -2e-6};
    f.measured.j2000_to_camera = {0.5, -0.5, 0.5, -0.5};
    f.measured.rate_rad_s = {1e-6, 2e-6, -3e-6};
    f.counts.commands = 10 + sequence;
    f.counts.dropped = 3;
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  std::vector<std::uint16_t> pixels;
  drivers::FrameView view;
};

/// What the document says of a format, written once more.
inline Bytes expected(const drivers::UvcSpec& s, drivers::UvcFormat format,
                      std::uint64_t sequence) {
  const Picture picture(s, sequence);
  Bytes out;
  std::size_t i = 0;
  for (int v = 0; v < s.height_px + s.rows_below; ++v) {
    for (int u = 0; u < s.width_px; ++u, ++i) {
      const unsigned dn = picture.pixels[i];
      const unsigned top = v >= s.height_px ? dn : dn >> (s.bits > 8 ? s.bits - 8 : 0);
      if (format == drivers::UvcFormat::kY16) {
        out.push_back(static_cast<std::byte>(dn & 0xFF));
        out.push_back(static_cast<std::byte>(dn >> 8));
      } else {
        out.push_back(static_cast<std::byte>(top));
        if (format == drivers::UvcFormat::kYuy2) out.push_back(std::byte{0x80});
      }
    }
    if (format == drivers::UvcFormat::kYuy2 && s.width_px % 2 != 0) {
      out.push_back(std::byte{0});
      out.push_back(std::byte{0x80});
    }
  }
  return out;
}

}  // namespace uvc_frames
