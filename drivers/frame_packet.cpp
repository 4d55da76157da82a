#include "drivers/frame_packet.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "engine/core/crc32c.h"

namespace drivers {
namespace {

using engine::crc32c;
using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::SimTime;

static_assert(std::endian::native == std::endian::little, "the wire format is written as it lies");

constexpr char kFrameMagic[4] = {'S', 'L', 'F', '1'};
constexpr std::size_t kHeaderCrcAt = 92;

template <class T>
void put(std::span<std::byte> out, std::size_t at, const T& value) noexcept {
  std::memcpy(out.data() + at, &value, sizeof value);
}

template <class T>
[[nodiscard]] T get(std::span<const std::byte> in, std::size_t at) noexcept {
  T value{};
  std::memcpy(&value, in.data() + at, sizeof value);
  return value;
}

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

}  // namespace

engine::Expected<std::size_t> encode_frame(const hil::Frame& frame,
                                           std::span<std::byte> out) noexcept {
  if (frame.pixels == nullptr) return rejected("frame without pixels");
  const int width = frame.pixels->width();
  const int height = frame.pixels->height();
  const std::size_t bytes = frame_bytes(width, height);
  if (out.size() < bytes) return rejected("frame larger than the link's slot");
  const auto pixels = std::as_bytes(frame.pixels->pixels());
  std::memset(out.data(), 0, kFrameHeaderBytes);
  put(out, 0, kFrameMagic);
  put(out, 4, static_cast<std::uint16_t>(kFrameHeaderBytes));
  put(out, 8, frame.sequence);
  put(out, 16, frame.shutter_open.time_since_epoch().count());
  put(out, 24, frame.exposure.count());
  put(out, 32, static_cast<std::uint16_t>(width));
  put(out, 34, static_cast<std::uint16_t>(height));
  put(out, 36, static_cast<std::uint8_t>(frame.bits));
  put(out, 56, frame.trim_rad[0]);
  put(out, 64, frame.trim_rad[1]);
  put(out, 72, static_cast<std::uint32_t>(pixels.size()));
  put(out, 76, crc32c(pixels));
  put(out, kHeaderCrcAt, crc32c(out.first(kHeaderCrcAt)));
  std::memcpy(out.data() + kFrameHeaderBytes, pixels.data(), pixels.size());
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
  view.pixels = in.subspan(kFrameHeaderBytes);
  if (in.size() != frame_bytes(view.width_px, view.height_px) ||
      get<std::uint32_t>(in, 72) != view.pixels.size()) {
    return rejected("length of the payload");
  }
  if (get<std::uint32_t>(in, 76) != crc32c(view.pixels)) return rejected("payload checksum");
  view.frame.sequence = get<std::uint64_t>(in, 8);
  view.frame.shutter_open = SimTime(Duration(get<std::int64_t>(in, 16)));
  view.frame.exposure = Duration(get<std::int64_t>(in, 24));
  view.frame.bits = get<std::uint8_t>(in, 36);
  view.frame.trim_rad = {get<double>(in, 56), get<double>(in, 64)};
  if (view.frame.bits < 1 || view.frame.bits > 16) return rejected("bits of a pixel");
  if (!std::isfinite(view.frame.trim_rad[0]) || !std::isfinite(view.frame.trim_rad[1]))
    return rejected("a number that is not finite");
  return view;
}

}  // namespace drivers
