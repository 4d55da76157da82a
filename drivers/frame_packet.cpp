#include "drivers/frame_packet.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/little_endian.h"
#include "engine/core/crc32c.h"

namespace drivers {
namespace {

using engine::crc32c;
using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::SimTime;

constexpr char kFrameMagic[4] = {'S', 'L', 'F', '2'};
constexpr std::size_t kPayloadBytesAt = 144;
constexpr std::size_t kPayloadCrcAt = 148;
constexpr std::size_t kHeaderCrcAt = 188;

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

template <std::size_t n>
[[nodiscard]] bool all_finite(const std::array<double, n>& values) noexcept {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

void put_header(const hil::Frame& frame, std::span<std::byte> out) noexcept {
  std::memset(out.data(), 0, kFrameHeaderBytes);
  put(out, 0, kFrameMagic);
  put(out, 4, static_cast<std::uint16_t>(kFrameHeaderBytes));
  put(out, 8, frame.sequence);
  put(out, 16, frame.shutter_open.time_since_epoch().count());
  put(out, 24, frame.exposure.count());
  put(out, 32, static_cast<std::uint16_t>(frame.pixels->width()));
  put(out, 34, static_cast<std::uint16_t>(frame.pixels->height()));
  put(out, 36, static_cast<std::uint8_t>(frame.bits));
  put(out, 37, static_cast<std::uint8_t>(frame.telemetry_row.empty() ? 0 : 1));
  put(out, 40, frame.trim_rad);
  put(out, 56, frame.measured.j2000_to_camera);
  put(out, 88, frame.measured.rate_rad_s);
  put(out, 112, frame.counts.skipped);
  put(out, 120, frame.counts.dropped);
  put(out, 128, frame.counts.late);
  put(out, 136, frame.counts.commands);
}

void get_header(std::span<const std::byte> in, hil::Frame& frame) noexcept {
  frame.sequence = get<std::uint64_t>(in, 8);
  frame.shutter_open = SimTime(Duration(get<std::int64_t>(in, 16)));
  frame.exposure = Duration(get<std::int64_t>(in, 24));
  frame.bits = get<std::uint8_t>(in, 36);
  frame.trim_rad = get<hil::TrimAngles>(in, 40);
  frame.measured.j2000_to_camera = get<hil::Quaternion>(in, 56);
  frame.measured.rate_rad_s = get<std::array<double, 3>>(in, 88);
  frame.counts = {get<std::uint64_t>(in, 112), get<std::uint64_t>(in, 120),
                  get<std::uint64_t>(in, 128), get<std::uint64_t>(in, 136)};
}

}  // namespace

engine::Expected<std::size_t> encode_frame(const hil::Frame& frame,
                                           std::span<std::byte> out) noexcept {
  if (frame.pixels == nullptr) return rejected("frame without pixels");
  const int width = frame.pixels->width();
  const auto row = std::as_bytes(frame.telemetry_row);
  if (!row.empty() && frame.telemetry_row.size() != static_cast<std::size_t>(width))
    return rejected("telemetry row not as wide as the image");
  const std::size_t bytes = frame_bytes(width, frame.pixels->height(), row.empty() ? 0 : 1);
  if (out.size() < bytes) return rejected("frame larger than the link's slot");
  const auto pixels = std::as_bytes(frame.pixels->pixels());
  const std::span<std::byte> payload = out.subspan(kFrameHeaderBytes, bytes - kFrameHeaderBytes);
  std::copy(pixels.begin(), pixels.end(), payload.begin());
  std::copy(row.begin(), row.end(), payload.end() - static_cast<std::ptrdiff_t>(row.size()));
  put_header(frame, out);
  put(out, kPayloadBytesAt, static_cast<std::uint32_t>(payload.size()));
  put(out, kPayloadCrcAt, crc32c(payload));
  put(out, kHeaderCrcAt, crc32c(out.first(kHeaderCrcAt)));
  return bytes;
}

engine::Expected<FrameView> decode_frame(std::span<const std::byte> in) noexcept {
  if (in.size() < kFrameHeaderBytes) return rejected("shorter than a header");
  if (std::memcmp(in.data(), kFrameMagic, sizeof kFrameMagic) != 0) return rejected("magic");
  if (get<std::uint32_t>(in, kHeaderCrcAt) != crc32c(in.first(kHeaderCrcAt)))
    return rejected("header checksum");
  if (get<std::uint16_t>(in, 4) != kFrameHeaderBytes) return rejected("header length");
  FrameView view;
  view.width_px = get<std::uint16_t>(in, 32);
  view.height_px = get<std::uint16_t>(in, 34);
  if (view.width_px < 1 || view.width_px > kLargestSide_px || view.height_px < 1 ||
      view.height_px > kLargestSide_px) {
    return rejected("size of the image");
  }
  const int rows_below = get<std::uint8_t>(in, 37);
  if (rows_below > kMostRowsBelow) return rejected("rows below the image");
  const auto payload = in.subspan(kFrameHeaderBytes);
  if (in.size() != frame_bytes(view.width_px, view.height_px, rows_below) ||
      get<std::uint32_t>(in, kPayloadBytesAt) != payload.size()) {
    return rejected("length of the payload");
  }
  if (get<std::uint32_t>(in, kPayloadCrcAt) != crc32c(payload)) return rejected("payload checksum");
  view.pixels = payload.first(frame_bytes(view.width_px, view.height_px) - kFrameHeaderBytes);
  view.telemetry_row = payload.subspan(view.pixels.size());
  get_header(in, view.frame);
  if (view.frame.bits < 1 || view.frame.bits > 16) return rejected("bits of a pixel");
  if (!all_finite(view.frame.trim_rad) || !all_finite(view.frame.measured.j2000_to_camera) ||
      !all_finite(view.frame.measured.rate_rad_s)) {
    return rejected("a number that is not finite");
  }
  return view;
}

}  // namespace drivers
