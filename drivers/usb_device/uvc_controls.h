#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/expected.h"
#include "hil/camera_link.h"

namespace drivers {

/// What the controls of a camera are in bytes: little-endian; uvc_protocol.md has the places. All
/// are integers: angles in nanoradians of 32 bits reach 2.147 rad to either side.

/// Controls of the extension unit.
enum class UvcSelector : std::uint8_t {
  kCommand = 1,  ///< to the camera
  kFrame = 2,    ///< what the camera says of a frame
  kSelect = 3,   ///< of which
  kCounts = 4,
};
inline constexpr unsigned kUvcSelectors = 4;

inline constexpr std::size_t kUvcCommandBytes = 72;
using UvcCommandBytes = std::array<std::byte, kUvcCommandBytes>;
/// Values beyond what the fields can hold are cut off at their ends. Pre: a report, a trim, a rate,
/// a mode or a trigger, with finite numbers.
[[nodiscard]] UvcCommandBytes encode_uvc_command(const hil::Command& command) noexcept;
/// kRejected for bytes that are no such command; the step is what is wrong with them.
[[nodiscard]] engine::Expected<hil::Command> decode_uvc_command(
    std::span<const std::byte> in) noexcept;

/// What the camera says of a frame, its times and its own measured attitude.
struct UvcFrameNews {
  std::uint64_t sequence = std::numeric_limits<std::uint64_t>::max();  ///< the default: none
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  int bits = 0;
  hil::TrimAngles trim_rad{};
  hil::MeasuredAttitude measured;
  std::uint64_t commands = 0;  ///< obeyed by the loop so far
  bool cut_off = false;        ///< a number was none, or beyond its field
};
inline constexpr std::size_t kUvcFrameBytes = 72;
using UvcFrameBytes = std::array<std::byte, kUvcFrameBytes>;
[[nodiscard]] UvcFrameBytes encode_uvc_frame(const UvcFrameNews& news) noexcept;
/// Pre: kUvcFrameBytes.
[[nodiscard]] UvcFrameNews decode_uvc_frame(std::span<const std::byte> in) noexcept;

/// Counts that add up: offered == idle + sent + overtaken + cut + in_hand.
struct UvcCounts {
  std::uint64_t offered = 0;        ///< frames of the camera
  std::uint64_t idle = 0;           ///< of them: nobody streamed
  std::uint64_t sent = 0;           ///< whole
  std::uint64_t overtaken = 0;      ///< a newer one came before they were begun
  std::uint64_t cut = 0;            ///< the host stopped before they were whole
  std::uint64_t in_hand = 0;        ///< begun, or next
  std::uint64_t missed = 0;         ///< gaps in the camera's numbers: they never came here
  std::uint64_t refused = 0;        ///< frames of another size, not among the offered
  std::uint64_t commands = 0;       ///< passed on
  std::uint64_t commands_lost = 0;  ///< the camera was gone, or its queue full
  std::uint64_t stalled = 0;        ///< requests that were none of ours
  std::uint64_t last_command = std::numeric_limits<std::uint64_t>::max();  ///< its sequence
  /// Plus the host's count of frames since it began to stream, the sequence of a frame.
  std::uint64_t first_sequence = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t skipped = 0;  ///< by the loop, as of the last frame
  std::uint64_t dropped = 0;
  std::uint64_t late = 0;

  friend bool operator==(const UvcCounts&, const UvcCounts&) = default;
};
inline constexpr std::size_t kUvcCountsBytes = 16 * sizeof(std::uint64_t);
using UvcCountsBytes = std::array<std::byte, kUvcCountsBytes>;
[[nodiscard]] UvcCountsBytes encode_uvc_counts(const UvcCounts& counts) noexcept;
/// Pre: kUvcCountsBytes.
[[nodiscard]] UvcCounts decode_uvc_counts(std::span<const std::byte> in) noexcept;

/// Pan and tilt in arc seconds, as every camera has them.
struct PanTilt {
  std::int32_t pan_arcsec = 0;
  std::int32_t tilt_arcsec = 0;
};
inline constexpr std::size_t kPanTiltBytes = 8;
inline constexpr std::int32_t kMostPanTilt_arcsec = 180 * 3600;
[[nodiscard]] std::array<std::byte, kPanTiltBytes> encode_pan_tilt(PanTilt p) noexcept;
/// kRejected beyond half a turn. Pre: kPanTiltBytes.
[[nodiscard]] engine::Expected<PanTilt> decode_pan_tilt(std::span<const std::byte> in) noexcept;
[[nodiscard]] hil::TrimAngles trim_of(PanTilt p) noexcept;

}  // namespace drivers
