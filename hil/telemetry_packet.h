#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <variant>

#include "hil/camera_link.h"
#include "hil/port_counts.h"

namespace hil {

/// What the camera says besides its pixels, as CCSDS Space Packets (133.0-B-2); protocol.md is the
/// interface control document. All numbers big-endian. Telemetry packets:
///    0  2  version 0, type 0, secondary header 1, APID = 0x200 + kind of telemetry
///    2  2  sequence flags 3, a count of the packets of this APID modulo 2^14
///    4  2  bytes of the packet less 7
///    6  1  protocol, 1
///    7  1  flags: 0
///    8  8  frame (unsigned); all ones: none yet
///   16  8  simulated time, ns (signed)
///   24  n  by kind, below
///   ..  4  CRC-32C of all before
/// By kind (0x200 on), numbers of 8 bytes all:
///   0 frame: exposure, ns; skipped, dropped, late, commands (unsigned). Time: the shutter opens
///   1 attitude: quaternion w, x, y, z J2000 -> camera; rates x, y, z, rad/s; trims x, y, rad
///     (doubles). Time: mid-exposure
///   2 time: CLOCK_MONOTONIC of the host when the frame was handed over, ns. Time: as frame
///   3 housekeeping: skipped, dropped, late, commands; 6 counts of refusals; 20 counts of the port
///   4 pong: sequence and made-at of the ping; CLOCK_MONOTONIC of the answer, ns
inline constexpr unsigned kTelemetryApid = 0x200;
inline constexpr std::size_t kTelemetryHeaderBytes = 24;
inline constexpr std::size_t kLargestTelemetryBytes =
    kTelemetryHeaderBytes + 8 * (4 + kRefusals + kPortCounts) + 4;
inline constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

/// A frame is on its way, and what was lost before it.
struct FrameNews {
  std::uint64_t frame = kNoFrame;
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  LoopCounts counts;  ///< without the refusals: those are housekeeping
};

/// What star tracker, gyro and the trim's own sensor say.
struct AttitudeNews {
  std::uint64_t frame = kNoFrame;
  engine::SimTime mid_exposure{};
  MeasuredAttitude measured;
  TrimAngles trim_rad{};
};

/// Ties the simulated time line to a clock that another process of the same host can read.
struct TimeNews {
  std::uint64_t frame = kNoFrame;
  engine::SimTime shutter_open{};
  engine::Duration monotonic{};  ///< CLOCK_MONOTONIC when the frame was handed over
};

/// What became of all commands so far.
struct Housekeeping {
  std::uint64_t frame = kNoFrame;
  engine::SimTime shutter_open{};
  LoopCounts counts;
  PortCounts port;
};

/// The answer to a ping.
struct Pong {
  std::uint64_t frame = kNoFrame;  ///< the last one announced
  engine::SimTime shutter_open{};  ///< of that frame
  std::uint64_t sequence = 0;      ///< of the ping
  engine::SimTime made_at{};       ///< of the ping
  engine::Duration monotonic{};    ///< CLOCK_MONOTONIC of the answer
};

/// The place in the list is the kind.
using Telemetry = std::variant<FrameNews, AttitudeNews, TimeNews, Housekeeping, Pong>;
inline constexpr std::size_t kTelemetryKinds = std::variant_size_v<Telemetry>;

/// Telemetry in its bytes.
struct TelemetryPacket {
  std::array<std::byte, kLargestTelemetryBytes> storage{};
  std::size_t used = 0;

  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::span(storage).first(used);
  }
};

/// `count`: how many packets of this kind went before.
[[nodiscard]] TelemetryPacket encode_telemetry(const Telemetry& news, std::uint64_t count) noexcept;

/// kRejected for anything that is not exactly one whole telemetry packet with finite numbers.
[[nodiscard]] engine::Expected<Telemetry> decode_telemetry(std::span<const std::byte> in) noexcept;

}  // namespace hil
