#include "drivers/usb_packet.h"

#include <algorithm>

#include "drivers/frame_packet.h"
#include "drivers/little_endian.h"
#include "drivers/pixel_packing.h"
#include "engine/core/crc32c.h"
#include "hil/telemetry_packet.h"

namespace drivers {
namespace {

using engine::crc32c;
using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::Fault;
using engine::SimTime;

constexpr char kFrameMagic[4] = {'S', 'L', 'U', '1'};
constexpr char kLimitsMagic[4] = {'S', 'L', 'U', 'L'};
constexpr char kMessageMagic[2] = {'S', 'M'};
constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kHeaderCrcAt = 60;
constexpr std::size_t kLimitsCrcAt = 28;
constexpr std::size_t kMessageCrcAt = 12;

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

template <std::size_t n>
[[nodiscard]] bool begins_with(std::span<const std::byte> in, const char (&magic)[n]) noexcept {
  return std::memcmp(in.data(), magic, n) == 0;
}

std::size_t pixel_bytes(PixelFormat format, std::size_t pixels) noexcept {
  return format == PixelFormat::kPacked11 ? packed_bytes(pixels) : 2 * pixels;
}

/// The rows of a frame and the one below it, one after the other.
std::size_t put_pixels(const hil::Frame& frame, PixelFormat format,
                       std::span<std::byte> out) noexcept {
  const std::span<const std::uint16_t> image = frame.pixels->pixels();
  const std::span<const std::uint16_t> row = frame.telemetry_row;
  if (format == PixelFormat::kPlain16) {
    std::memcpy(out.data(), image.data(), image.size_bytes());
    if (!row.empty()) std::memcpy(out.data() + image.size_bytes(), row.data(), row.size_bytes());
    return image.size_bytes() + row.size_bytes();
  }
  const std::size_t bytes = packed_bytes(image.size() + row.size());
  pack_pixels(image, out);
  if (row.empty()) return bytes;
  // The row begins where the image ends, which may be inside a byte: together with the pixels that
  // share its first bytes, it is packed from the start of their group.
  constexpr std::size_t kGroup = 8;
  const std::size_t shared = image.size() % kGroup;
  std::array<std::uint16_t, 2 * kGroup> seam{};
  const std::size_t of_row = std::min(row.size(), kGroup - shared);
  std::copy(image.end() - static_cast<std::ptrdiff_t>(shared), image.end(), seam.begin());
  std::copy_n(row.begin(), of_row, seam.begin() + static_cast<std::ptrdiff_t>(shared));
  const std::size_t at = packed_bytes(image.size() - shared);
  const std::size_t seam_bytes =
      pack_pixels(std::span(seam).first(shared + of_row), out.subspan(at));
  if (of_row < row.size()) pack_pixels(row.subspan(of_row), out.subspan(at + seam_bytes));
  return bytes;
}

std::size_t put_news(const hil::Frame& frame, std::span<std::byte> out) noexcept {
  const SimTime middle = frame.shutter_open + frame.exposure / 2;
  const std::array<hil::Telemetry, 2> news = {
      hil::FrameNews{frame.sequence, frame.shutter_open, frame.exposure, frame.counts},
      hil::AttitudeNews{frame.sequence, middle, frame.measured, frame.trim_rad}};
  std::size_t used = 0;
  for (const hil::Telemetry& n : news) {
    const hil::TelemetryPacket packet = hil::encode_telemetry(n, frame.sequence);
    std::copy(packet.bytes().begin(), packet.bytes().end(),
              out.begin() + static_cast<std::ptrdiff_t>(used));
    used += packet.used;
  }
  return used;
}

bool in(int value, int low, int high) noexcept { return low <= value && value <= high; }

}  // namespace

std::array<std::byte, kUsbLimitsBytes> encode_limits(const UsbLimits& l) noexcept {
  std::array<std::byte, kUsbLimitsBytes> out{};
  put(std::span(out), 0, kLimitsMagic);
  put(std::span(out), 4, static_cast<std::uint16_t>(kVersion));
  put(std::span(out), 6, static_cast<std::uint16_t>(l.formats));
  put(std::span(out), 8, static_cast<std::uint16_t>(l.width_px));
  put(std::span(out), 10, static_cast<std::uint16_t>(l.height_px));
  put(std::span(out), 12, l.payload_bytes);
  put(std::span(out), 16, static_cast<std::uint16_t>(l.frames));
  put(std::span(out), kLimitsCrcAt, crc32c(std::span(out).first(kLimitsCrcAt)));
  return out;
}

Expected<UsbLimits> decode_limits(std::span<const std::byte> in_bytes) noexcept {
  if (in_bytes.size() != kUsbLimitsBytes || !begins_with(in_bytes, kLimitsMagic))
    return rejected("usb: no limits");
  if (get<std::uint32_t>(in_bytes, kLimitsCrcAt) != crc32c(in_bytes.first(kLimitsCrcAt)))
    return rejected("usb: checksum of the limits");
  if (get<std::uint16_t>(in_bytes, 4) != kVersion) return rejected("usb: version of the device");
  UsbLimits l;
  l.formats = get<std::uint16_t>(in_bytes, 6);
  l.width_px = get<std::uint16_t>(in_bytes, 8);
  l.height_px = get<std::uint16_t>(in_bytes, 10);
  l.payload_bytes = get<std::uint32_t>(in_bytes, 12);
  l.frames = get<std::uint16_t>(in_bytes, 16);
  if (l.frames < 1) return rejected("usb: a device without room for a frame");
  return l;
}

std::size_t usb_payload_bytes(PixelFormat format, int width_px, int rows) noexcept {
  return pixel_bytes(format, static_cast<std::size_t>(width_px) * static_cast<std::size_t>(rows)) +
         kUsbNewsBytes;
}

Expected<std::size_t> encode_usb_frame(const hil::Frame& frame, PixelFormat format,
                                       std::span<std::byte> out) noexcept {
  if (frame.pixels == nullptr) return rejected("frame without pixels");
  const int width = frame.pixels->width();
  const int height = frame.pixels->height();
  const int below = frame.telemetry_row.empty() ? 0 : 1;
  if (below != 0 && frame.telemetry_row.size() != static_cast<std::size_t>(width))
    return rejected("telemetry row not as wide as the image");
  if (format == PixelFormat::kPacked11 && frame.bits > static_cast<int>(kPackedBits))
    return rejected("more bits a pixel than the format holds");
  if (out.size() < kUsbHeaderBytes + usb_payload_bytes(format, width, height + below))
    return rejected("frame larger than the link's slot");
  const std::span<std::byte> payload = out.subspan(kUsbHeaderBytes);
  const std::size_t pixels = put_pixels(frame, format, payload);
  const std::size_t news = put_news(frame, payload.subspan(pixels));
  const std::size_t bytes = pixels + news;
  std::memset(out.data(), 0, kUsbHeaderBytes);
  put(out, 0, kFrameMagic);
  put(out, 4, static_cast<std::uint16_t>(kUsbHeaderBytes));
  put(out, 6, static_cast<std::uint8_t>(format));
  put(out, 7, static_cast<std::uint8_t>(frame.bits));
  put(out, 8, static_cast<std::uint16_t>(width));
  put(out, 10, static_cast<std::uint16_t>(height));
  put(out, 12, static_cast<std::uint8_t>(below));
  put(out, 14, static_cast<std::uint16_t>(news));
  put(out, 16, frame.sequence);
  put(out, 24, frame.shutter_open.time_since_epoch().count());
  put(out, 32, frame.exposure.count());
  put(out, 40, static_cast<std::uint32_t>(bytes));
  put(out, 44, crc32c(payload.first(bytes)));
  put(out, kHeaderCrcAt, crc32c(out.first(kHeaderCrcAt)));
  return kUsbHeaderBytes + bytes;
}

Expected<UsbFrameHeader> decode_usb_header(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < kUsbHeaderBytes) return rejected("shorter than a header");
  if (!begins_with(bytes, kFrameMagic)) return rejected("magic");
  if (get<std::uint32_t>(bytes, kHeaderCrcAt) != crc32c(bytes.first(kHeaderCrcAt)))
    return rejected("header checksum");
  UsbFrameHeader h;
  const auto format = get<std::uint8_t>(bytes, 6);
  h.bits = get<std::uint8_t>(bytes, 7);
  h.width_px = get<std::uint16_t>(bytes, 8);
  h.height_px = get<std::uint16_t>(bytes, 10);
  h.rows_below = get<std::uint8_t>(bytes, 12);
  h.news_bytes = get<std::uint16_t>(bytes, 14);
  h.sequence = get<std::uint64_t>(bytes, 16);
  h.shutter_open = SimTime(Duration(get<std::int64_t>(bytes, 24)));
  h.exposure = Duration(get<std::int64_t>(bytes, 32));
  h.payload_bytes = get<std::uint32_t>(bytes, 40);
  h.payload_crc32c = get<std::uint32_t>(bytes, 44);
  if (get<std::uint16_t>(bytes, 4) != kUsbHeaderBytes || format >= kPixelFormats ||
      !in(h.bits, 1, 16) || !in(h.width_px, 1, kLargestSide_px) ||
      !in(h.height_px, 1, kLargestSide_px) || !in(h.rows_below, 0, kMostRowsBelow) ||
      h.news_bytes > kUsbNewsBytes)
    return rejected("a number of the header");
  h.format = static_cast<PixelFormat>(format);
  const auto pixels =
      static_cast<std::size_t>(h.width_px) * static_cast<std::size_t>(h.height_px + h.rows_below);
  if (h.payload_bytes != pixel_bytes(h.format, pixels) + h.news_bytes)
    return rejected("length of the payload");
  return h;
}

Expected<std::size_t> encode_usb_message(const UsbMessage& m, std::span<std::byte> out) noexcept {
  const bool is_status = m.kind == UsbMessage::Kind::kStatus;
  const std::size_t body = is_status ? kUsbStatusBytes : m.command.size();
  const std::size_t bytes = kUsbMessageHeaderBytes + body;
  if (bytes > kLargestUsbMessage || bytes > out.size()) return rejected("usb: message too long");
  put(out, 0, kMessageMagic);
  put(out, 2, m.kind);
  put(out, 3, kVersion);
  put(out, 4, static_cast<std::uint16_t>(body));
  put(out, 6, m.count);
  put(out, 8, m.session);
  const std::span<std::byte> b = out.subspan(kUsbMessageHeaderBytes, body);
  if (is_status) {
    const UsbStatus& s = m.status;
    put(b, 0, s.credits);
    put(b, 4, s.good);
    put(b, 8, s.last_sequence);
    put(b, 16, s.bad_headers);
    put(b, 20, s.bad_checksums);
    put(b, 24, s.short_frames);
    put(b, 28, s.long_frames);
    put(b, 32, s.not_taken);
    put(b, 36, std::uint32_t{0});
  } else {
    std::copy(m.command.begin(), m.command.end(), b.begin());
  }
  put(out, kMessageCrcAt, std::uint32_t{0});
  put(out, kMessageCrcAt, crc32c(out.first(bytes)));
  return bytes;
}

Expected<UsbMessage> decode_usb_message(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < kUsbMessageHeaderBytes || bytes.size() > kLargestUsbMessage ||
      !begins_with(bytes, kMessageMagic) || get<std::uint8_t>(bytes, 3) != kVersion ||
      get<std::uint16_t>(bytes, 4) != bytes.size() - kUsbMessageHeaderBytes)
    return rejected("usb: no message");
  std::array<std::byte, kLargestUsbMessage> copy{};
  std::copy(bytes.begin(), bytes.end(), copy.begin());
  put(std::span(copy), kMessageCrcAt, std::uint32_t{0});
  if (get<std::uint32_t>(bytes, kMessageCrcAt) != crc32c(std::span(copy).first(bytes.size())))
    return rejected("usb: checksum of a message");
  UsbMessage m;
  m.count = get<std::uint16_t>(bytes, 6);
  m.session = get<std::uint32_t>(bytes, 8);
  const std::span<const std::byte> b = bytes.subspan(kUsbMessageHeaderBytes);
  switch (get<std::uint8_t>(bytes, 2)) {
    case static_cast<std::uint8_t>(UsbMessage::Kind::kStatus):
      if (b.size() != kUsbStatusBytes) return rejected("usb: length of a status");
      m.kind = UsbMessage::Kind::kStatus;
      m.status = {.credits = get<std::uint32_t>(b, 0),
                  .good = get<std::uint32_t>(b, 4),
                  .last_sequence = get<std::uint64_t>(b, 8),
                  .bad_headers = get<std::uint32_t>(b, 16),
                  .bad_checksums = get<std::uint32_t>(b, 20),
                  .short_frames = get<std::uint32_t>(b, 24),
                  .long_frames = get<std::uint32_t>(b, 28),
                  .not_taken = get<std::uint32_t>(b, 32)};
      return m;
    case static_cast<std::uint8_t>(UsbMessage::Kind::kCommand):
      m.kind = UsbMessage::Kind::kCommand;
      m.command = b;
      return m;
    default:
      return rejected("usb: kind of message");
  }
}

}  // namespace drivers
