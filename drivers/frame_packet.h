#pragma once

#include <cstddef>
#include <span>

#include "engine/core/expected.h"
#include "hil/camera_link.h"

namespace drivers {

/// The wire format of frames: header, byte order, checksums; nothing else. All numbers
/// little-endian. What comes back are the Space Packets of hil/space_packet.h.
///
/// A frame is a 96-byte header and rows of pixels, 16 bits each, the value in the low bits:
///    0  4  "SLF1"             32  2  width in pixels         64  8  trim y, rad (double)
///    4  2  header bytes, 96   34  2  height in pixels        72  4  payload bytes
///    6  2  reserved, 0        36  1  bits of a pixel         76  4  CRC-32C of the payload
///    8  8  sequence           37  3  reserved, 0             80 12  reserved, 0
///   16  8  shutter open, ns   40 16  reserved, 0             92  4  CRC-32C of bytes 0 to 91
///   24  8  exposure, ns       56  8  trim x, rad (double)
///
/// Times are simulated nanoseconds after the scenario's epoch. Pixel (0, 0) has its centre at (0,
/// 0).
inline constexpr std::size_t kFrameHeaderBytes = 96;
inline constexpr int kLargestSide_px = 4096;

[[nodiscard]] constexpr std::size_t frame_bytes(int width_px, int height_px) noexcept {
  return kFrameHeaderBytes +
         2 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
}

/// Returns how many bytes of `out` it used; kRejected when they are too few.
[[nodiscard]] engine::Expected<std::size_t> encode_frame(const hil::Frame& frame,
                                                         std::span<std::byte> out) noexcept;

/// A frame seen in its bytes: valid as long as they are.
struct FrameView {
  hil::Frame frame;  ///< frame.pixels is null
  int width_px = 0;
  int height_px = 0;
  std::span<const std::byte> pixels;  ///< 2 * width * height, rows from the top
};
/// kRejected, with the step that found it, for bytes that are not exactly one whole frame.
[[nodiscard]] engine::Expected<FrameView> decode_frame(std::span<const std::byte> in) noexcept;

}  // namespace drivers
