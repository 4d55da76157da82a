#pragma once

#include <cstddef>
#include <span>

#include "engine/core/expected.h"
#include "hil/camera_link.h"

namespace drivers {

/// The wire format of frames: header, byte order, checksums; nothing else. All numbers
/// little-endian. What comes back are the Space Packets of hil/space_packet.h.
///
/// A frame is a 192-byte header and rows of pixels, 16 bits each, the value in the low bits:
///    0  4  "SLF2"                      40 16  trim x, y, rad (doubles)
///    4  2  header bytes, 192           56 32  quaternion w, x, y, z J2000 -> camera (doubles)
///    6  2  reserved, 0                 88 24  rate x, y, z, rad/s, camera axes (doubles)
///    8  8  sequence                   112  8  frames skipped before this one left the loop
///   16  8  shutter open, ns           120  8  frames dropped
///   24  8  exposure, ns               128  8  frames late
///   32  2  width in pixels            136  8  commands obeyed
///   34  2  height in pixels           144  4  payload bytes, (height + rows below) * width * 2
///   36  1  bits of a pixel            148  4  CRC-32C of the payload
///   37  1  telemetry rows below: 0, 1 152 36  reserved, 0
///   38  2  reserved, 0                188  4  CRC-32C of bytes 0 to 187
///
/// Trim, attitude and rate are what camera, star tracker and gyro say at mid-exposure. Times are
/// simulated nanoseconds after the scenario's epoch. Pixel (0, 0) has its centre at (0, 0). The
/// telemetry row is as wide as the image (hil/telemetry_row.h). Readers leave reserved bytes alone.
inline constexpr std::size_t kFrameHeaderBytes = 192;
inline constexpr int kLargestSide_px = 4096;
inline constexpr int kMostRowsBelow = 1;

[[nodiscard]] constexpr std::size_t frame_bytes(int width_px, int height_px,
                                                int rows_below = 0) noexcept {
  return kFrameHeaderBytes +
         2 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px + rows_below);
}
/// What a slot for the frames of such a camera has to hold.
[[nodiscard]] constexpr std::size_t largest_frame_bytes(int width_px, int height_px) noexcept {
  return frame_bytes(width_px, height_px, kMostRowsBelow);
}

/// Returns how many bytes of `out` it used; kRejected when they are too few, or when the telemetry
/// row is not as wide as the image.
[[nodiscard]] engine::Expected<std::size_t> encode_frame(const hil::Frame& frame,
                                                         std::span<std::byte> out) noexcept;

/// A frame seen in its bytes: valid as long as they are.
struct FrameView {
  hil::Frame frame;  ///< frame.pixels is null and frame.telemetry_row empty
  int width_px = 0;
  int height_px = 0;
  std::span<const std::byte> pixels;         ///< 2 * width * height, rows from the top
  std::span<const std::byte> telemetry_row;  ///< 2 * width, or empty
};
/// kRejected, with the step that found it, for bytes that are not exactly one whole frame.
[[nodiscard]] engine::Expected<FrameView> decode_frame(std::span<const std::byte> in) noexcept;

}  // namespace drivers
