#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "engine/core/expected.h"
#include "hil/camera_link.h"

namespace drivers {

// The bytes of the USB stream; usb_protocol.md is the document for those who build a device. All
// numbers little-endian. Loop-safe.

/// How pixels lie in a payload.
enum class PixelFormat : std::uint8_t {
  kPlain16 = 0,   ///< 16 bits each, the value in the low ones
  kPacked11 = 1,  ///< pixel_packing.h
};
inline constexpr unsigned kPixelFormats = 2;

inline constexpr std::size_t kUsbHeaderBytes = 64;
/// Room for the telemetry packets that follow the pixels.
inline constexpr std::size_t kUsbNewsBytes = 512;
inline constexpr std::size_t kUsbMessageHeaderBytes = 16;
inline constexpr std::size_t kLargestUsbMessage = 512;
inline constexpr std::size_t kUsbLimitsBytes = 32;
inline constexpr std::size_t kUsbStatusBytes = 40;

/// Interface of the device, by which it is found.
inline constexpr std::uint8_t kUsbClass = 0xFF;  // vendor
inline constexpr std::uint8_t kUsbSubclass = 0x53;
inline constexpr std::uint8_t kUsbProtocol = 0x01;
/// Vendor requests to that interface.
enum class UsbRequest : std::uint8_t { kLimits = 1, kReset = 2, kStatus = 3 };

/// What a device can take: the answer to UsbRequest::kLimits.
struct UsbLimits {
  unsigned formats = 1U << static_cast<unsigned>(PixelFormat::kPlain16);
  int width_px = 0;
  int height_px = 0;  ///< a telemetry row included
  std::uint32_t payload_bytes = 0;
  unsigned frames = 1;  ///< that it has room for at once

  [[nodiscard]] bool takes(PixelFormat format) const noexcept {
    return (formats >> static_cast<unsigned>(format) & 1U) != 0;
  }
};
[[nodiscard]] std::array<std::byte, kUsbLimitsBytes> encode_limits(const UsbLimits& l) noexcept;
[[nodiscard]] engine::Expected<UsbLimits> decode_limits(std::span<const std::byte> in) noexcept;

/// A frame's payload: what encode_usb_frame() writes after the header at most.
[[nodiscard]] std::size_t usb_payload_bytes(PixelFormat format, int width_px, int rows) noexcept;

/// Header, pixels, telemetry row, and what the camera knows of itself as the packets of
/// hil/telemetry_packet.h. Returns how many bytes of `out` it used; kRejected when they are too
/// few, or when the pixels have more bits than the format.
[[nodiscard]] engine::Expected<std::size_t> encode_usb_frame(const hil::Frame& frame,
                                                             PixelFormat format,
                                                             std::span<std::byte> out) noexcept;

/// A header whose checksum is right and whose numbers agree.
struct UsbFrameHeader {
  PixelFormat format = PixelFormat::kPlain16;
  int bits = 0;
  int width_px = 0;
  int height_px = 0;
  int rows_below = 0;
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  std::uint32_t news_bytes = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t payload_crc32c = 0;
};
[[nodiscard]] engine::Expected<UsbFrameHeader> decode_usb_header(
    std::span<const std::byte> in) noexcept;

/// What the device has counted since the session began, and how many frames it lets the host begin
/// in all.
struct UsbStatus {
  std::uint32_t credits = 0;
  std::uint32_t good = 0;
  std::uint64_t last_sequence = std::numeric_limits<std::uint64_t>::max();  ///< the default: none
  std::uint32_t bad_headers = 0;
  std::uint32_t bad_checksums = 0;
  std::uint32_t short_frames = 0;  ///< ended before their payload did
  std::uint32_t long_frames = 0;   ///< went on after it
  std::uint32_t not_taken = 0;     ///< good, but nobody on board had room for them

  friend bool operator==(const UsbStatus&, const UsbStatus&) = default;
};

/// What comes back on the bulk IN endpoint, one in each transfer.
struct UsbMessage {
  enum class Kind : std::uint8_t { kStatus = 1, kCommand = 2 };
  Kind kind = Kind::kStatus;
  std::uint16_t count = 0;    ///< of messages of this session before, modulo 2^16
  std::uint32_t session = 0;  ///< that of the last reset
  UsbStatus status;
  std::span<const std::byte> command;  ///< a packet of hil/space_packet.h, not looked into
};
/// Returns how many bytes of `out` it used; kRejected when they are too few.
[[nodiscard]] engine::Expected<std::size_t> encode_usb_message(const UsbMessage& message,
                                                               std::span<std::byte> out) noexcept;
/// kRejected for bytes that are not exactly one whole message.
[[nodiscard]] engine::Expected<UsbMessage> decode_usb_message(
    std::span<const std::byte> in) noexcept;

}  // namespace drivers
