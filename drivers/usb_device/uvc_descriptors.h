#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/usb_device/usb_function.h"
#include "engine/core/time.h"

namespace drivers {

/// The camera that a host sees: what its source gives, and how it goes out.
struct UvcSpec {
  int width_px = 1024;   ///< in [1, 4096]
  int height_px = 1024;  ///< in [1, 4096], without a telemetry row
  int rows_below = 0;    ///< telemetry rows, 0 or 1
  int bits = 11;         ///< of a pixel, in [1, 16]
  engine::Duration period{100'000'000};
  bool super_speed = true;  ///< else high speed, for hosts that know no more
  /// Most of one payload, its header included. The default is the largest transfer of Linux' own
  /// driver at SuperSpeed.
  std::uint32_t payload_bytes = 32 * 1024;
};

/// What a pixel becomes; the number is the format's in the descriptors.
enum class UvcFormat : std::uint8_t {
  kY16 = 1,   ///< 16 bits, little-endian, the value in the low ones
  kY8 = 2,    ///< its highest eight bits
  kYuy2 = 3,  ///< those as brightness, two bytes a pixel; an odd row gets a black pixel more
};
inline constexpr unsigned kUvcFormats = 3;

struct UvcFrameSize {
  int width_px = 0;
  int height_px = 0;
  std::uint32_t bytes = 0;
};
[[nodiscard]] UvcFrameSize uvc_frame_size(const UvcSpec& spec, UvcFormat format) noexcept;
/// Of a frame, in the 100 ns of USB Video.
[[nodiscard]] std::uint32_t uvc_interval(const UvcSpec& spec) noexcept;

// Interfaces, and units of the first one.
inline constexpr unsigned kUvcControlInterface = 0;
inline constexpr unsigned kUvcStreamInterface = 1;
inline constexpr unsigned kUvcCameraTerminal = 1;
inline constexpr unsigned kUvcExtensionUnit = 2;
inline constexpr unsigned kUvcOutputTerminal = 3;
inline constexpr unsigned kUvcEndpoint = 1;  // bulk IN

/// Of the extension unit: 0c6157a4-7487-4012-9bab-b09316a02372, in the order of a GUID's bytes.
inline constexpr std::array<std::uint8_t, 16> kUvcExtensionGuid = {
    0xa4, 0x57, 0x61, 0x0c, 0x87, 0x74, 0x12, 0x40, 0x9b, 0xab, 0xb0, 0x93, 0x16, 0xa0, 0x23, 0x72};

/// Of the time stamps in payload headers.
inline constexpr std::uint32_t kUvcClock_hz = 1'000'000;

/// USB Video Class 1.1, bulk, one frame size, one interval; uvc_protocol.md says what is in them.
[[nodiscard]] UsbDescriptors uvc_descriptors(const UvcSpec& spec);

}  // namespace drivers
