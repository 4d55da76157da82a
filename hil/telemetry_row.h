#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/expected.h"
#include "engine/core/time.h"
#include "hil/camera_link.h"

namespace hil {

/// A row of pixels below the image that says which frame this is, for links that carry pixels and
/// nothing else, and whether the image above it is that frame's: a driver whose buffers have no
/// owner may change one that is being read. One byte a pixel, in its low 8 bits, so that every link
/// of 8 bits or more carries it; a pixel over 255 is no telemetry. Numbers little-endian, places
/// counted in pixels:
///    0  4  "SLTR"                       24  8  exposure middle, ns
///    4  1  version, 2                   32  8  exposure end, ns
///    5  1  pixels used, 56              40  8  sequence of the link: frames it was given before
///    6  2  reserved, 0                  48  4  CRC-32C of the image's bytes, as the link has them
///    8  8  frame id                     52  4  CRC-32C of bytes 0 to 51
///   16  8  exposure start, ns           56  .  0 to the end of the row
/// The frame id is the sequence of the frame header: the period it belongs to, whatever the seed.
/// Times are simulated nanoseconds after the scenario's epoch. The image's bytes are its pixels in
/// 16 bits, little-endian, from the top, without this row; a link that makes others of them says so
/// of those.
struct TelemetryRow {
  std::uint64_t frame_id = 0;
  engine::SimTime exposure_start{};
  engine::SimTime exposure_middle{};
  engine::SimTime exposure_end{};
  std::uint64_t link_sequence = 0;
  std::uint32_t image_crc32c = 0;

  friend bool operator==(const TelemetryRow&, const TelemetryRow&) = default;
};
inline constexpr std::size_t kTelemetryRowPixels = 56;
/// Cameras with fewer bits a pixel cannot carry it.
inline constexpr int kTelemetryRowBits = 8;

/// What the row below this frame says. Reads all of the image. Loop-safe.
[[nodiscard]] TelemetryRow telemetry_of(const Frame& frame, std::uint64_t link_sequence) noexcept;

/// Fills all of `row`, as wide as the camera; kRejected under kTelemetryRowPixels. Loop-safe.
[[nodiscard]] engine::Status encode_telemetry_row(const TelemetryRow& telemetry,
                                                  std::span<std::uint16_t> row) noexcept;

/// kRejected, with the step that found it, for a row that does not say exactly this.
[[nodiscard]] engine::Expected<TelemetryRow> decode_telemetry_row(
    std::span<const std::uint16_t> row) noexcept;

}  // namespace hil
